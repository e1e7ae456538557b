#include <algorithm>
#include <memory>

#include <fmt/format.h>
#include <unistd.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/interrupt.hpp"
#include "api/cli/object_verbs.hpp"
#include "api/cli/rows.hpp"
#include "api/cli/task_rows.hpp"
#include "api/cli/transition_verbs.hpp"

namespace plchost {

namespace {

struct WatchArguments {
  std::string instance;
  double interval_s = 1.0;
  std::uint64_t count = 0;  // 0: until Ctrl-C
};

void print_block(const CliSession& session, const std::vector<Row>& rows, bool first) {
  if (session.options.json) return session.show(rows, task_columns());
  if (::isatty(STDOUT_FILENO) != 0) {
    fmt::print("\x1b[H\x1b[2J");
  } else if (!first) {
    fmt::print("\n");
  }
  session.show(rows, task_columns());
}

int watch(CliSession& session, const WatchArguments& arguments) {
  catch_interrupts();
  const auto interval =
      std::chrono::duration_cast<Duration>(std::chrono::duration<double>(arguments.interval_s));
  TimePoint next = MonotonicClock::now();
  for (std::uint64_t i = 0; !interrupted() && (arguments.count == 0 || i < arguments.count); ++i) {
    if (i > 0) {
      sleep_until_interrupted(next);
      if (interrupted()) break;
    }
    const auto rows = task_rows(session, arguments.instance);
    if (!rows) return CliSession::fail(rows.error());
    print_block(session, *rows, i == 0);
    next = std::max(next + interval, MonotonicClock::now());
  }
  return kExitDone;
}

}  // namespace

void add_watch_verb(const Command& plcctl, CliSession& session) {
  const Command verb = plcctl.verb("watch", "Show tasks, changes of state, or of one object, as they come");
  const auto arguments = std::make_shared<WatchArguments>();
  constexpr double kMinInterval = 0.1;
  constexpr double kMaxInterval = 3600;
  verb.noun("tasks", "The tasks with live figures, until Ctrl-C",
            [&session, arguments] { return watch(session, *arguments); })
      .optional("INSTANCE", arguments->instance, "only of this instance")
      .option("--interval", arguments->interval_s, "seconds between two looks (default 1)", kMinInterval,
              kMaxInterval)
      .option("--count", arguments->count, "end after so many looks", std::uint64_t{0}, kMaxCount);
  add_watch_transitions(verb, session);
  add_watch_object(verb, session);
}

}  // namespace plchost
