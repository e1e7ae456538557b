#include <memory>
#include <utility>

#include <fmt/format.h>

#include "api/cli/cli_session.hpp"

namespace plchost {

namespace {

struct PostArguments {
  std::string name;
  std::uint64_t count = 1;
  std::int64_t interval_us = 0;
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
    fmt::print("{} posted{}\n", report.accepted,
               report.no_task > 0
                   ? fmt::format(", {} of them while no task was bound to the event", report.no_task)
                   : "");
  }
  if (report.unacknowledged > 0) {
    return CliSession::fail({ErrorCode::timed_out, 0,
                             fmt::format("host '{}' has stopped answering: of {} posts nothing is known",
                                         host, report.unacknowledged)});
  }
  if (report.rejected == 0) return kExitDone;
  std::string text = fmt::format("{} rejected: {}", report.rejected, report.rejected_text);
  if (report.rejected_code == ErrorCode::not_found) text += event_hint(session, host, arguments.name);
  fmt::print(stderr, "plcctl: {}\n", text);
  return kExitFailed;
}

int post(CliSession& session, const PostArguments& arguments) {
  auto parts = split_name("EVENT", arguments.name);
  if (!parts) return CliSession::fail(parts.error());
  const auto host = session.target_host();
  if (!host) return CliSession::fail(host.error());
  const ApiRequest event{*host, 0, std::move(parts->first), std::move(parts->second)};
  const auto report = session.client().value()->post_event(
      event, arguments.count, std::chrono::microseconds(arguments.interval_us), session.timeout());
  if (!report) return CliSession::fail(report.error());
  return tell(session, *host, arguments, *report);
}

}  // namespace

void add_post_verb(const Command& plcctl, CliSession& session) {
  const auto arguments = std::make_shared<PostArguments>();
  constexpr std::int64_t kMaxIntervalUs = 3'600'000'000;
  plcctl.verb("post", "Post an external event")
      .noun("event", "Post an external event: each task bound to it runs once",
            [&session, arguments] { return post(session, *arguments); })
      .argument("INSTANCE/EVENT", arguments->name)
      .option("--count", arguments->count, "how often (default 1)", std::uint64_t{1}, kMaxCount)
      .option("--interval-us", arguments->interval_us, "time between two posts, microseconds (default 0)",
              std::int64_t{0}, kMaxIntervalUs);
}

}  // namespace plchost
