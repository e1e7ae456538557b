#include <algorithm>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/interrupt.hpp"
#include "api/cli/rows/rows.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

struct PostArguments {
  std::string name;
  std::uint64_t count = 1;
  std::int64_t interval_us = 0;
  std::string wait = "pool";
};

std::string event_hint(CliSession& session, const std::string& host, const std::string& name) {
  std::vector<std::string> names;
  if (const auto all = session.client().value()->events(host, session.deadline())) {
    for (const auto& event : *all) {
      if (event.registered) names.push_back(fmt::format("{}/{}", event.instance, event.event));
    }
  }
  return fmt::format("{}; registered are: {}", hint(name, names),
                     names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")));
}

int tell(CliSession& session, const std::string& host, const PostArguments& arguments,
         const PostReport& report) {
  if (session.options.json) {
    fmt::print("{}", format_json({Row{{"host", host},
                                      {"event", arguments.name},
                                      {"accepted", report.accepted},
                                      {"no_task", report.no_task},
                                      {"rejected", report.rejected},
                                      {"unacknowledged", report.unacknowledged},
                                      {"problem", report.rejected_text}}}));
  } else if (report.accepted > 0) {
    session.say(fmt::format(
        "{} posted{}", report.accepted,
        report.no_task > 0 ? fmt::format(", {} of them while no task was bound to the event", report.no_task)
                           : ""));
  }
  if (report.unacknowledged > 0) {
    return CliSession::fail({ErrorCode::timed_out, 0,
                             fmt::format("host '{}' has stopped answering: the fate of {} is not known", host,
                                         count_text(report.unacknowledged, "post"))});
  }
  if (report.rejected == 0) return kExitDone;
  std::string text = fmt::format("{} rejected: {}", report.rejected, report.rejected_text);
  if (report.rejected_code == ErrorCode::not_found) text += event_hint(session, host, arguments.name);
  fmt::print(stderr, "plcctl: {}\n", printable(std::move(text)));
  return kExitFailed;
}

/// The one in the middle, in microseconds.
double median_us(std::vector<Duration> values) {
  std::ranges::sort(values);
  return to_us(values[values.size() / 2].count());
}

int tell_runs(const CliSession& session, const std::string& host, const PostArguments& arguments,
              const std::vector<RunReport>& runs) {
  const auto of = [&runs](Duration RunReport::* member) {
    std::vector<Duration> values;
    for (const RunReport& run : runs) values.push_back(run.*member);
    return values;
  };
  const std::vector<Duration> round_trips = of(&RunReport::round_trip);
  const double least = to_us(std::ranges::min(round_trips).count());
  const double most = to_us(std::ranges::max(round_trips).count());
  const Row row{{"host", host},
                {"event", arguments.name},
                {"posts", runs.size()},
                {"tasks", runs.back().tasks},
                {"last_task", runs.back().last_task},
                {"start_median_us", median_us(of(&RunReport::to_start))},
                {"end_median_us", median_us(of(&RunReport::to_end))},
                {"round_trip_min_us", least},
                {"round_trip_median_us", median_us(round_trips)},
                {"round_trip_max_us", most}};
  if (session.options.json) {
    fmt::print("{}", format_json({row}));
    return kExitDone;
  }
  fmt::print(
      "{} posted and run, last by {}: {:.1f} us from here and back{}; on the host {:.1f} us to the start of "
      "its cycle, {:.1f} us to the end\n",
      runs.size(), printable(runs.back().last_task), median_us(round_trips),
      runs.size() > 1 ? fmt::format(" (median; {:.1f} to {:.1f})", least, most) : "",
      median_us(of(&RunReport::to_start)), median_us(of(&RunReport::to_end)));
  return kExitDone;
}

int post_and_await(CliSession& session, const PostArguments& arguments, const HostEvent& event) {
  std::vector<RunReport> runs;
  if (arguments.count > 1) catch_interrupts();
  const TimePoint first = MonotonicClock::now();
  for (std::uint64_t i = 0; i < arguments.count; ++i) {
    const TimePoint next =
        first + std::chrono::microseconds(arguments.interval_us) * static_cast<std::int64_t>(i);
    while (MonotonicClock::now() < next && !interrupted()) {
      session.client().value()->wait_for_change(std::min(next, MonotonicClock::now() + kInterruptLook));
    }
    if (interrupted()) break;
    const auto run = session.client().value()->post_and_await(event, session.timeout());
    if (!run) {
      Error error = run.error();
      if (error.code == ErrorCode::not_found && !error.message.starts_with("no task")) {
        error.message += event_hint(session, event.host, arguments.name);
      }
      if (i > 0) error.message += fmt::format(" (after {} that were run)", i);
      return CliSession::fail(error);
    }
    runs.push_back(*run);
  }
  const int code = runs.empty() ? kExitDone : tell_runs(session, event.host, arguments, runs);
  if (runs.size() == arguments.count) return code;
  fmt::print(stderr, "plcctl: interrupted: {} of {} were not posted\n", arguments.count - runs.size(),
             arguments.count);
  return kExitFailed;
}

int post(CliSession& session, const PostArguments& arguments) {
  auto parts = split_name("EVENT", arguments.name);
  if (!parts) return CliSession::fail(parts.error());
  const auto host = session.target_host();
  if (!host) return CliSession::fail(host.error());
  const HostEvent event{*host, std::move(parts->first), std::move(parts->second)};
  if (arguments.wait == "run") return post_and_await(session, arguments, event);
  if (arguments.count > 1) catch_interrupts();
  const auto report = session.client().value()->post_event(event, arguments.count,
                                                           std::chrono::microseconds(arguments.interval_us),
                                                           session.timeout(), interrupted);
  if (!report) return CliSession::fail(report.error());
  const int code = tell(session, *host, arguments, *report);
  if (!interrupted()) return code;
  const std::uint64_t done = report->accepted + report->rejected + report->unacknowledged;
  fmt::print(stderr, "plcctl: interrupted: {} of {} were not posted\n", arguments.count - done,
             arguments.count);
  return std::max(code, kExitFailed);
}

int post_batch(CliSession& session, const std::vector<std::string>& names) {
  std::vector<EventId> events;
  for (const std::string& name : names) {
    auto parts = split_name("EVENT", name);
    if (!parts) return CliSession::fail(parts.error());
    events.push_back({std::move(parts->first), std::move(parts->second)});
  }
  const auto host = session.target_host();
  if (!host) return CliSession::fail(host.error());
  const auto report = session.client().value()->post_batch(*host, events, session.timeout());
  if (!report) return CliSession::fail(report.error());
  if (report->rejected > 0) return CliSession::fail({report->rejected_code, 0, report->rejected_text});
  if (session.options.json) {
    fmt::print("{}",
               format_json({Row{{"host", *host}, {"events", names}, {"no_task", report->no_task > 0}}}));
  } else {
    session.say(
        fmt::format("{} posted{}", names.size(),
                    report->no_task > 0 ? ", at least one of them while no task was bound to it" : ""));
  }
  return kExitDone;
}

}  // namespace

void add_post_verb(const Command& plcctl, CliSession& session) {
  const auto arguments = std::make_shared<PostArguments>();
  constexpr std::int64_t kMaxIntervalUs = 3'600'000'000;
  const Command verb = plcctl.verb("post", "Post external events");
  verb.noun("event", "Post an external event: each task bound to it runs once",
            [&session, arguments] { return post(session, *arguments); })
      .argument("INSTANCE/EVENT", arguments->name)
      .option("--count", arguments->count, "how often (default 1)", std::uint64_t{1}, kMaxCount)
      .option("--interval-us", arguments->interval_us, "time between two posts, microseconds (default 0)",
              std::int64_t{0}, kMaxIntervalUs)
      .choice("--wait{pool}", arguments->wait,
              "until the post is in the pool (--wait=pool, as without it). Or until its tasks have ended "
              "their cycles for it, one post after the other, and how long that took (--wait=run)",
              {"pool", "run"});
  const auto names = std::make_shared<std::vector<std::string>>();
  verb.noun("events", "Post several external events (up to 64) at once: all of them, or none",
            [&session, names] { return post_batch(session, *names); })
      .arguments("INSTANCE/EVENT", *names);
}

}  // namespace plchost
