#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/interrupt.hpp"
#include "api/cli/verbs/host_commands.hpp"
#include "api/dds/code_names.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

struct WaitArguments {
  std::vector<std::string> names;
  std::string state = "running";
};

/// The state that is waited for, and the one that is there.
struct Awaited {
  std::string name;
  std::string state;  ///< as it was seen last; empty: it was not
  std::string problem;
};

/// Takes those away that have the state by now. Whether all that were named are there.
Result<void> look(CliSession& session, const std::string& host, const std::string& state,
                  std::vector<Awaited>& awaited) {
  PLCHOST_TRY_ASSIGN(const auto samples, session.client().value()->instances(host, session.deadline()));
  std::vector<std::string> known;
  for (const plc_InstanceStatus& sample : samples) {
    known.emplace_back(dds::text_of(sample.instance));
    const auto one = std::ranges::find(awaited, known.back(), &Awaited::name);
    if (one == awaited.end()) continue;
    one->state = dds::instance_state_name(sample.state);
    one->problem = dds::text_of(sample.problem);
  }
  for (const Awaited& one : awaited) {
    if (one.state.empty()) return unknown_name("instance", one.name, known, host);
  }
  for (const Awaited& one : awaited) {
    if (one.state == state) session.say(fmt::format("{}: {}", one.name, state));
  }
  std::erase_if(awaited, [&](const Awaited& one) { return one.state == state; });
  return {};
}

// A host that has just started may not be seen yet, or not whole.
bool may_come(const Error& error) {
  return error.code == ErrorCode::timed_out || error.code == ErrorCode::unavailable;
}

Result<std::string> host_until(CliSession& session, TimePoint end) {
  for (;;) {
    auto host = session.target_host();
    if (host || !may_come(host.error()) || MonotonicClock::now() >= end || interrupted()) return host;
  }
}

Result<void> wait_until(CliSession& session, const WaitArguments& arguments, TimePoint end) {
  PLCHOST_TRY_ASSIGN(const auto host, host_until(session, end));
  PLCHOST_TRY_ASSIGN(const auto instances, expand(session, arguments.names));
  std::vector<Awaited> awaited;
  for (const NamedInstance& one : instances) {
    if (std::ranges::find(awaited, one.name, &Awaited::name) != awaited.end()) continue;
    awaited.push_back({.name = one.name, .state = {}, .problem = {}});
  }
  for (;;) {
    const auto looked = look(session, host, arguments.state, awaited);
    const TimePoint now = MonotonicClock::now();
    const bool over = now >= end || interrupted();
    if (!looked && (over || !may_come(looked.error()))) return looked;
    if (awaited.empty()) return {};
    if (over) break;
    session.client().value()->wait_for_change(std::min(end, now + kInterruptLook));
  }
  const Awaited& first = awaited.front();
  return failure(ErrorCode::timed_out,
                 fmt::format("'{}' is not {} but {}{}{}", first.name, arguments.state, first.state,
                             first.problem.empty() ? "" : ": ", first.problem));
}

int wait(CliSession& session, const WaitArguments& arguments) {
  constexpr Duration kPatience = std::chrono::seconds(60);
  catch_interrupts();
  const auto waited = wait_until(session, arguments, session.deadline(kPatience));
  return waited ? kExitDone : CliSession::fail(waited.error());
}

}  // namespace

void add_wait_verb(const Command& plcctl, CliSession& session) {
  const auto arguments = std::make_shared<WaitArguments>();
  constexpr std::uint32_t kMostStates = 64;
  std::vector<std::string> states;
  // A number stands for a state that this program does not know.
  for (std::uint32_t state = 0; state < kMostStates; ++state) {
    if (std::string name = dds::instance_state_name(state); name != fmt::format("{}", state))
      states.push_back(std::move(name));
  }
  const Command verb = plcctl.verb("wait", "Wait until an instance has a state");
  verb.noun("instance", "Wait until all of these have the state (60 s, or --timeout)",
            [&session, arguments] { return wait(session, *arguments); })
      .arguments("INSTANCE", arguments->names, "one or more; 'line*' stands for all that begin with line")
      .word("--for", arguments->state, "the state (default running)", states);
}

}  // namespace plchost
