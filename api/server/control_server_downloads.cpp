#include <utility>

#include "api/control/application_order.hpp"
#include "api/dds/samples.hpp"
#include "api/dds/text.hpp"
#include "api/dds/time_limit.hpp"
#include "api/server/control_server_parts.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

// The manager's time for what came: its helper first, then as any other command.
constexpr Duration kStoring = std::chrono::seconds(50);

}  // namespace

// Its answer comes when it is loaded. Its sender goes with it, for the list of kept applications.
void ControlServer::Parts::begin_download(const dds::Guid& client, const plc_SampleIdentity& identity,
                                          ControlRequest request) {
  if (const auto subject = guard.identity_of(client)) {
    request.options[std::string(kByOption)] =
        fmt::format("{} {}", security::to_string(subject->role), subject->name);
  }
  request.options[std::string(kFromOption)] = sessions->describe(client);
  if (const auto begun = downloads.begin(client, identity, std::move(request), MonotonicClock::now());
      !begun) {
    return answer(client, identity, begun.error().code, begun.error().describe());
  }
  serve_downloads(MonotonicClock::now());
}

// At most a batch at a time: others want this thread, too.
void ControlServer::Parts::on_chunks() {
  constexpr std::size_t kAtOnce = 16;
  const dds_entity_t reader = chunks.reader.get();
  const TimePoint now = MonotonicClock::now();
  {
    const dds::Samples<plc_DownloadChunk, kAtOnce> batch(reader);
    if (batch.size() == 0) return;
    for (std::size_t i = 0; i < batch.size(); ++i) {
      if (!batch.valid(i) || dds::text_of(batch[i].host) != options.host) continue;
      if (dds::timeliness(batch[i].limit, epoch) != dds::Timeliness::in_time) continue;
      const dds::Guid writer = dds::writer_of(reader, batch.info(i));
      if (writer != dds::Guid{}) downloads.take(batch[i], writer.participant(), now);
    }
    if (batch.full()) raise_event(wake.get());
  }
  serve_downloads(now);
}

void ControlServer::Parts::serve_downloads(TimePoint now) {
  for (const DownloadProgress& progress : downloads.progress()) {
    plc_DownloadAck ack{};
    dds::copy_text(ack.host, options.host);
    ack.epoch = epoch;
    ack.download = progress.identity;
    ack.received = progress.received;
    ack.window = DownloadTable::kWindow;
    sessions->write_ack(progress.client, ack);
  }
  for (CompleteDownload& complete : downloads.complete()) {
    constexpr Duration kLimit = ManagerLink::kCommandLimit + kStoring;
    complete.request.limit_ns = boot_time_ns() + kLimit.count();
    const PendingCommand command{complete.client, complete.identity,     complete.request.instance,
                                 now + kLimit,    complete.request.verb, {}};
    if (auto sent = manager->send(std::move(complete.request), command); !sent) {
      downloads.end(complete.identity);
      answer(complete.client, complete.identity, sent.error().code, sent.error().describe());
    }
  }
  const auto is_alive = [this](const dds::Guid& client) { return sessions->is_alive(client); };
  for (const DownloadEnd& end : downloads.given_up(now, is_alive)) {
    spdlog::info("a download is given up: {}", end.why.describe());
    answer(end.client, end.identity, end.why.code, end.why.describe());
  }
}

}  // namespace plchost
