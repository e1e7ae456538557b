// A client's way to learn that its post was run.
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "api/client/client_core.hpp"
#include "api/client/client_core_status.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

/// How often a post is posted again to an instance that is starting.
constexpr Duration kInstanceLook = std::chrono::milliseconds(20);

bool has_writer(dds_entity_t reader) {
  dds_subscription_matched_status_t status{};
  return dds_get_subscription_matched_status(reader, &status) == DDS_RETCODE_OK && status.current_count > 0;
}

}  // namespace

Async<Result<void>> ClientCore::prepare_runs(std::string host, TimePoint deadline) {
  const dds::Qos qos = dds::answers_qos(dds::kEventRun, dds::kEventRun.qos.depth);
  PLCHOST_CO_TRY(open_own_reader<plc_EventRun>(runs_, qos));
  PLCHOST_CO_TRY(co_await prepare_posts(host, deadline));
  while (!has_writer(runs_.reader.get())) {
    if (MonotonicClock::now() >= deadline) {
      co_return failure(ErrorCode::timed_out,
                        fmt::format("host '{}' does not tell when tasks have run", host));
    }
    co_await pump_->change(std::min(deadline, MonotonicClock::now() + std::chrono::milliseconds(1)));
  }
  co_return Result<void>();
}

void ClientCore::take_runs() {
  dds::take_valid_told<plc_EventRun>(
      runs_.reader.get(), answering_, [&](const plc_EventRun& run, const auto& /*info*/) {
        const AnswerKey post(dds::Guid::from(run.source), static_cast<std::int64_t>(run.sequence_number),
                             dds::text_of(run.host));
        run_.put(post, [&]() -> Result<RunReport> {
          if (run.code != 0)
            return failure(static_cast<ErrorCode>(run.code), printable_lines(dds::text_of(run.text)));
          return RunReport{.tasks = run.tasks,
                           .last_task = std::string(dds::text_of(run.last_task)),
                           .to_start = Duration(run.start_ns),
                           .to_end = Duration(run.end_ns),
                           .round_trip = {}};
        });
      });
}

Async<Result<RunReport>> ClientCore::post_and_await(HostEvent event, Duration patience) {
  PLCHOST_CO_TRY(check_host_name(event.host, only_));
  PLCHOST_CO_TRY(check_event_name(event.instance, event.event));
  const TimePoint deadline = MonotonicClock::now() + patience;
  PLCHOST_CO_TRY(co_await prepare_runs(event.host, deadline));
  for (;;) {
    auto run = co_await post_and_await_once(event, deadline);
    const TimePoint again = MonotonicClock::now() + kInstanceLook;
    if (run || run.error().code != ErrorCode::unavailable || again >= deadline) co_return run;
    while (MonotonicClock::now() < again) co_await pump_->change(again);
  }
}

// It has the turn until its post is acknowledged: other posts need not wait for the task.
Async<Result<RunReport>> ClientCore::post_and_await_once(HostEvent event, TimePoint deadline) {
  auto turn = co_await turn_to_post(event.host, deadline);
  if (!turn) {
    co_return failure(ErrorCode::timed_out,
                      fmt::format("other posts of this client to host '{}' have not ended", event.host));
  }
  PLCHOST_CO_TRY_ASSIGN(EventPoster* const way, poster<plc_EventPost>(event.host));
  EventPoster& posts = *way;
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
  Inbox<Result<RunReport>>::Expected told(run_,
                                          {posts.source(), static_cast<std::int64_t>(number), event.host});
  for (;;) {
    const TimePoint now = MonotonicClock::now();
    if (auto run = told.take_first()) {
      if (*run) (*run)->round_trip = now - start;
      co_return *std::move(run);
    }
    bool acknowledged = turn == nullptr;
    TimePoint again = deadline;
    if (turn) {
      use_clock(posts, event.host, deadline - start);
      acknowledged = posts.unacknowledged() == 0;
      if (const PostReport report = posts.report(); acknowledged && report.rejected > 0) {
        co_return failure(report.rejected_code, report.rejected_text);
      }
      if (acknowledged) {
        turn.reset();
      } else {
        again = posts.repeat(now);
      }
    }
    if (now >= deadline) break;
    // The server that was asked is gone, and with it what it waited for.
    if (acknowledged && epoch() != asked) {
      asked = epoch();
      posts.ask_again(number, id);
    }
    co_await pump_->change(std::min(deadline, again));
  }
  co_return failure(ErrorCode::timed_out, fmt::format("host '{}' has not told that a task ran", event.host));
}

}  // namespace plchost
