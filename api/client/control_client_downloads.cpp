#include <algorithm>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "api/client/control_client.hpp"
#include "api/client/control_client_status.hpp"
#include "api/client/file_sender.hpp"
#include "api/control/application_order.hpp"
#include "api/security/sha256.hpp"

namespace plchost {

namespace {

// A host that is started again needs a second, and its manager up to 5 s if it fails again and again.
constexpr Duration kDownloadStall = std::chrono::seconds(10);
// The host keeps it, tries it and loads it: longer than the server waits for the manager.
constexpr Duration kDownloadLoad = std::chrono::seconds(130);

ApiRequest request_for(const Download& download) {
  ApiRequest request{download.host, plc_OPERATION_DOWNLOAD_APPLICATION, download.instance, download.name};
  const std::string_view text(reinterpret_cast<const char*>(download.contents.data()),
                              download.contents.size());
  request.boot = download.boot;
  request.online = download.online;
  request.size = text.size();
  request.sha256 = sha256(text);
  return request;
}

}  // namespace

Result<ApiReply> ControlClient::download(const Download& download, const DownloadProgressFunction& progress,
                                         TimePoint deadline) {
  const ApiRequest request = request_for(download);
  PLCHOST_TRY(check_api_request(request, only_));
  PLCHOST_TRY(check_file_name(download.name));
  if (download.contents.empty()) return failure(ErrorCode::invalid_argument, download.name + " is empty");
  constexpr std::int32_t kOfEachHost = 16;
  const dds::Qos qos = dds::answers_qos(dds::kDownloadAck, kOfEachHost);
  PLCHOST_TRY(open_own_reader<plc_DownloadAck>(download_acks_, qos));
  if (!chunk_topic_) {
    PLCHOST_TRY_ASSIGN(chunk_topic_, dds::make_topic(entity(), dds::kDownloadChunk));
  }
  PLCHOST_TRY_ASSIGN(auto sender,
                     FileSender::create(entity(), chunk_topic_.get(), download.host, download.contents));
  std::uint64_t told = 0;
  const auto go_on = [&](const plc_SampleIdentity& identity, TimePoint now) -> RequestCaller::Wait {
    update();
    dds::take_valid_told<plc_DownloadAck>(
        download_acks_.reader.get(), answering_,
        [&](const plc_DownloadAck& ack, const auto& /*info*/) { sender.on_ack(ack, identity, now); });
    const bool begun = sender.last_news() != TimePoint{};
    const Duration patience = sender.complete() ? kDownloadLoad : kDownloadStall;
    const TimePoint end = begun ? std::max(deadline, sender.last_news() + patience) : deadline;
    const HostClock* const clock = clock_of(download.host);
    const bool done = sender.complete() || clock == nullptr;
    const TimePoint next =
        done ? now + FileSender::kRepeat : sender.send(identity, clock->limit_at(end), now);
    if (progress && sender.received() != told) progress(told = sender.received());
    return {.next = next, .deadline = end};
  };
  auto reply = ask(request, deadline, go_on);
  if (!reply && reply.error().code == ErrorCode::timed_out && sender.last_news() != TimePoint{}) {
    return failure(
        ErrorCode::timed_out,
        sender.complete()
            ? fmt::format("host '{}' has got {} and has not said what became of it", download.host,
                          download.name)
            : fmt::format("host '{}' has stopped answering: {} of {} bytes of {} are there", download.host,
                          sender.received(), download.contents.size(), download.name));
  }
  // The answer may come before the last acknowledgement.
  const bool done = reply && reply->code == ErrorCode::ok;
  if (done && progress && told != download.contents.size()) progress(download.contents.size());
  if (reply) await_status(request.host, *reply, MonotonicClock::now() + kStatusPatience);
  return reply;
}

}  // namespace plchost
