// A client's way to learn that its post was run, and posts of several events at once.
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "api/client/control_client.hpp"
#include "api/dds/text.hpp"

namespace plchost {

namespace {

bool has_writer(dds_entity_t reader) {
  dds_subscription_matched_status_t status{};
  return dds_get_subscription_matched_status(reader, &status) == DDS_RETCODE_OK && status.current_count > 0;
}

}  // namespace

Result<void> ControlClient::prepare_runs(const std::string& host, TimePoint deadline) {
  const dds::Qos qos = dds::answers_qos(dds::kEventRun, dds::kEventRun.qos.depth);
  if (auto opened = open_own_reader(runs_.topic, runs_.reader, dds::kEventRun, qos); !opened) return opened;
  if (auto ready = prepare_posts(host, deadline); !ready) return ready;
  while (!has_writer(runs_.reader.get())) {
    if (MonotonicClock::now() >= deadline) {
      return failure(ErrorCode::timed_out, fmt::format("host '{}' does not tell when tasks have run", host));
    }
    update();
    wait_set_.wait(std::min(deadline, MonotonicClock::now() + std::chrono::milliseconds(1)));
  }
  return {};
}

std::optional<Result<RunReport>> ControlClient::take_run(const EventPoster& posts, std::string_view host,
                                                         std::uint64_t number, TimePoint start) {
  std::optional<Result<RunReport>> found;
  dds::take_valid_told<plc_EventRun>(
      runs_.reader.get(), answering_, [&](const plc_EventRun& run, const auto& /*info*/) {
        if (dds::text_of(run.host) != host) return;  // no other host knows
        if (dds::Guid::from(run.source) != posts.source() || run.sequence_number != number)
          return;           // was given up
        if (found) return;  // told again for a repetition
        if (run.code != 0) {
          found = failure(static_cast<ErrorCode>(run.code), std::string(dds::text_of(run.text)));
          return;
        }
        found = RunReport{.tasks = run.tasks,
                          .last_task = std::string(dds::text_of(run.last_task)),
                          .to_start = Duration(run.start_ns),
                          .to_end = Duration(run.end_ns),
                          .round_trip = MonotonicClock::now() - start};
      });
  return found;
}

Result<RunReport> ControlClient::post_and_await(const ApiRequest& event, Duration patience) {
  if (auto good = check_event_name(event.instance, event.argument); !good) {
    return std::unexpected(std::move(good).error());
  }
  const TimePoint deadline = MonotonicClock::now() + patience;
  if (auto ready = prepare_runs(event.host, deadline); !ready) return std::unexpected(ready.error());
  EventPoster& posts = **poster(event.host);
  const auto epoch = [&] {
    const SeenHost* const seen = seen_.find(event.host);
    return seen != nullptr ? seen->server.value() : 0;
  };
  std::uint64_t asked = epoch();
  const TimePoint start = MonotonicClock::now();
  posts.begin_report(start);
  use_clock(posts, event.host, deadline - start);
  const std::uint64_t number = posts.post(event.instance, event.argument, start, /*awaited=*/true);
  for (;;) {
    const TimePoint now = MonotonicClock::now();
    (void)take_acks(now);
    if (auto run = take_run(posts, event.host, number, start)) return *std::move(run);
    const bool acknowledged = posts.unacknowledged() == 0;
    if (const PostReport report = posts.report(); acknowledged && report.rejected > 0) {
      return failure(report.rejected_code, report.rejected_text);
    }
    if (now >= deadline) break;
    update();
    use_clock(posts, event.host, deadline - start);
    // The server that was asked is gone, and with it what it waited for.
    if (acknowledged && epoch() != asked) {
      asked = epoch();
      posts.ask_again(number, event.instance, event.argument);
    }
    wait_set_.wait(std::min(deadline, posts.repeat(now)));
  }
  return failure(ErrorCode::timed_out, fmt::format("host '{}' has not told that a task ran", event.host));
}

Result<BatchPoster*> ControlClient::batch_poster(const std::string& host) {
  if (const auto known = batch_posters_.find(host); known != batch_posters_.end()) return &known->second;
  if (auto opened = open_own_reader(ack_topic_, ack_reader_, dds::kEventAck, dds::qos_of(dds::kEventAck));
      !opened) {
    return std::unexpected(opened.error());
  }
  if (!batch_topic_) {
    auto made = dds::make_topic(entity(), dds::kEventBatch);
    if (!made) return std::unexpected(made.error());
    batch_topic_ = std::move(*made);
  }
  auto made = BatchPoster::create(entity(), batch_topic_.get(), host);
  if (!made) return std::unexpected(made.error());
  if (auto added = wait_set_.add(made->writer(), DDS_PUBLICATION_MATCHED_STATUS); !added) {
    return std::unexpected(added.error());
  }
  return &batch_posters_.emplace(host, std::move(*made)).first->second;
}

Result<PostReport> ControlClient::post_batch(const std::string& host, std::span<const EventId> events,
                                             Duration patience) {
  if (auto good = check_host_name(host); !good) return std::unexpected(std::move(good).error());
  if (events.empty() || events.size() > kMaxBatch) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("a batch of {} events; allowed are 1 to {}", events.size(), kMaxBatch));
  }
  for (const EventId& event : events) {
    if (auto good = check_event_name(event.instance, event.event); !good)
      return std::unexpected(good.error());
  }
  const auto way = batch_poster(host);
  if (!way) return std::unexpected(way.error());
  BatchPoster& posts = **way;
  const TimePoint deadline = MonotonicClock::now() + patience;
  update_hosts();  // the limit is by the newest presence
  for (bool posted = false;;) {
    const TimePoint now = MonotonicClock::now();
    (void)take_acks(now);
    const HostClock* const clock = clock_of(host);
    if (clock != nullptr) posts.use_clock(*clock);
    if (!posted && clock != nullptr && posts.matched()) {
      posts.post(events, now, deadline);
      posted = true;
    }
    if (posted && posts.acknowledged()) return posts.report();
    if (now >= deadline) break;
    update();
    wait_set_.wait(std::min(deadline, posted ? posts.repeat(now) : deadline));
  }
  return failure(ErrorCode::timed_out, fmt::format("host '{}' has not acknowledged the batch", host));
}

}  // namespace plchost
