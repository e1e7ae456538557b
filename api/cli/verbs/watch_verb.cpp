#include <memory>

#include "api/cli/cli_session.hpp"
#include "api/cli/repeat.hpp"
#include "api/cli/rows/rows.hpp"
#include "api/cli/rows/status_rows.hpp"
#include "api/cli/verbs/object_verbs.hpp"
#include "api/cli/verbs/task_rows.hpp"
#include "api/cli/verbs/transition_verbs.hpp"
#include "api/cli/verbs/variable_recording.hpp"

namespace plchost {

namespace {

struct WatchArguments {
  std::string instance;
  double interval_s = 1.0;
  std::uint64_t count = 0;  // 0: until Ctrl-C
};

int watch(CliSession& session, const WatchArguments& arguments) {
  const Repetition repetition{.every_s = arguments.interval_s,
                              .count = arguments.count,
                              .for_programs = session.options.json || session.options.csv};
  return repeat(repetition, [&] {
    const auto rows = task_rows(session, arguments.instance);
    if (!rows) return CliSession::fail(rows.error());
    return session.show(*rows, columns_of<plc_TaskStatus>());
  });
}

}  // namespace

void add_watch_verb(const Command& plcctl, CliSession& session) {
  const Command verb = plcctl.verb(
      "watch",
      "Show changes of state as they come, or look at tasks, one object or variables again and again");
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
  add_watch_variables(verb, session);
}

}  // namespace plchost
