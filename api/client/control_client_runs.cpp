// A client's way to learn that its post was run.
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "api/client/control_client.hpp"
#include "api/client/control_client_status.hpp"
#include "api/dds/text.hpp"

namespace plchost {

namespace {

/// How often a post is posted again to an instance that is starting.
constexpr Duration kInstanceLook = std::chrono::milliseconds(20);

bool has_writer(dds_entity_t reader) {
  dds_subscription_matched_status_t status{};
  return dds_get_subscription_matched_status(reader, &status) == DDS_RETCODE_OK && status.current_count > 0;
}

}  // namespace

Result<void> ControlClient::prepare_runs(const std::string& host, TimePoint deadline) {
  const dds::Qos qos = dds::answers_qos(dds::kEventRun, dds::kEventRun.qos.depth);
  if (auto opened = open_own_reader<plc_EventRun>(runs_, qos); !opened) return opened;
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

Result<RunReport> ControlClient::post_and_await(const HostEvent& event, Duration patience) {
  PLCHOST_TRY(check_event_name(event.instance, event.event));
  const TimePoint deadline = MonotonicClock::now() + patience;
  PLCHOST_TRY(prepare_runs(event.host, deadline));
  for (;;) {
    auto run = post_and_await_once(event, deadline);
    const TimePoint again = MonotonicClock::now() + kInstanceLook;
    if (run || run.error().code != ErrorCode::unavailable || again >= deadline) return run;
    while (MonotonicClock::now() < again) {
      update();
      wait_set_.wait(again);
    }
  }
}

Result<RunReport> ControlClient::post_and_await_once(const HostEvent& event, TimePoint deadline) {
  EventPoster& posts = **poster<plc_EventPost>(event.host);
  const auto epoch = [&] {
    const SeenHost* const seen = seen_.find(event.host);
    return seen != nullptr ? seen->server.value() : 0;
  };
  std::uint64_t asked = epoch();
  const TimePoint start = MonotonicClock::now();
  (void)take_acks(start);  // of posts that were given up
  posts.begin_report(start);
  use_clock(posts, event.host, deadline - start);
  const EventId id = event.id();
  const std::uint64_t number = posts.post(id, start, /*awaited=*/true);
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
      posts.ask_again(number, id);
    }
    wait_set_.wait(std::min(deadline, posts.repeat(now)));
  }
  return failure(ErrorCode::timed_out, fmt::format("host '{}' has not told that a task ran", event.host));
}

}  // namespace plchost
