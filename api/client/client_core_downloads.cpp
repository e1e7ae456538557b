#include <algorithm>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "api/client/client_core.hpp"
#include "api/client/client_core_status.hpp"
#include "api/client/file_sender.hpp"
#include "api/control/application_order.hpp"
#include "api/dds/text.hpp"
#include "api/security/sha256.hpp"

namespace plchost {

namespace {

// A host that is started again needs a second, and its manager up to 5 s if it fails again and again.
constexpr Duration kDownloadStall = std::chrono::seconds(10);
// The host keeps it, tries it and loads it: longer than the server waits for the manager.
constexpr Duration kDownloadLoad = std::chrono::seconds(130);

/// The end of the wait for a host that has begun to receive. Of one that shows its presence no more, nothing
/// is to be heard, however long it would take to load.
TimePoint end_of_wait(const FileSender& sender, const SeenHost* host) {
  if (!sender.complete()) return sender.last_news() + kDownloadStall;
  const TimePoint last = host == nullptr ? sender.last_news() : host->server.last();
  return std::min(sender.last_news() + kDownloadLoad, std::max(sender.last_news(), last) + kDownloadStall);
}

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

void ClientCore::take_download_acks() {
  dds::take_valid_told<plc_DownloadAck>(download_acks_.reader.get(), answering_,
                                        [&](const plc_DownloadAck& ack, const auto& /*info*/) {
                                          downloaded_.put({ack.download, dds::text_of(ack.host)}, [&] {
                                            plc_DownloadAck kept = ack;
                                            kept.ext = {};  // it is lent
                                            return kept;
                                          });
                                        });
}

Async<Result<ApiReply>> ClientCore::download(Download download, DownloadProgressFunction progress,
                                             TimePoint deadline) {
  const ApiRequest request = request_for(download);
  PLCHOST_CO_TRY(check_api_request(request, only_));
  PLCHOST_CO_TRY(check_file_name(download.name));
  if (download.contents.empty()) co_return failure(ErrorCode::invalid_argument, download.name + " is empty");
  constexpr std::int32_t kOfEachHost = 16;
  const dds::Qos qos = dds::answers_qos(dds::kDownloadAck, kOfEachHost);
  PLCHOST_CO_TRY(open_own_reader<plc_DownloadAck>(download_acks_, qos));
  if (!chunk_topic_) {
    PLCHOST_CO_TRY_ASSIGN(chunk_topic_, dds::make_topic(entity(), dds::kDownloadChunk));
  }
  PLCHOST_CO_TRY_ASSIGN(auto sender,
                        FileSender::create(entity(), chunk_topic_.get(), download.host, download.contents));
  PLCHOST_CO_TRY_ASSIGN(auto asking, begin_asking(request));
  const plc_SampleIdentity identity = asking.request->header.request_identity;
  Inbox<plc_DownloadAck>::Expected acks(downloaded_, asking.key());
  std::uint64_t told = 0;
  const auto go_on = [&](TimePoint now) -> Wait {
    for (const plc_DownloadAck& ack : acks.take()) sender.on_ack(ack, identity, now);
    const bool begun = sender.last_news() != TimePoint{};
    const TimePoint end =
        begun ? std::max(deadline, end_of_wait(sender, seen_.find(download.host))) : deadline;
    const HostClock* const clock = clock_of(download.host);
    const bool done = sender.complete() || clock == nullptr;
    const TimePoint next =
        done ? now + FileSender::kRepeat : sender.send(identity, clock->limit_at(end), now);
    if (progress && sender.received() != told) progress(told = sender.received());
    return {.next = next, .deadline = end};
  };
  auto reply = co_await ask(std::move(asking), deadline, go_on);
  if (!reply && reply.error().code == ErrorCode::timed_out && sender.last_news() != TimePoint{}) {
    co_return failure(
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
  if (reply) {
    const std::uint64_t round = reply->status_round;
    co_await await_status(request.host, round, MonotonicClock::now() + kStatusPatience);
  }
  co_return reply;
}

}  // namespace plchost
