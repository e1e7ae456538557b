#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <control.h>
#include <nlohmann/json.hpp>

#include "api/cli/cli_session.hpp"
#include "api/dds/debug_page.hpp"
#include "api/dds/variable_page.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/operations/operations.hpp"

namespace plchost {

/// The requests of a debugger to the host of its instance.
struct DebugRequests {
  /// The text of the answer to an operation.
  std::function<Result<std::string>(ControlVerb verb, const std::string& argument)> call;
  std::function<Result<VariableListing>(const VariableQuery&)> list_variables;
  std::function<Result<DebugPart>(const DebugQuery&)> read_state;
  std::function<TimePoint()> now = MonotonicClock::now;
};

/// The same over DDS. The session outlives them.
[[nodiscard]] DebugRequests debug_requests(CliSession& session, const std::string& host,
                                           const std::string& instance);

/// A debug session with one instance: see instances/debugging.md.
class DebugLink {
 public:
  DebugLink(DebugRequests requests, std::string host, std::string instance)
      : requests_(std::move(requests)), host_(std::move(host)), instance_(std::move(instance)) {}

  [[nodiscard]] const std::string& instance() const noexcept { return instance_; }
  [[nodiscard]] TimePoint now() const { return requests_.now(); }

  /// Begins the session; the remark of the instance. `take`: also if another debugger has it.
  [[nodiscard]] Result<std::string> attach(bool take);
  /// Ends it: breakpoints go, tasks go on.
  [[nodiscard]] Result<void> detach();
  [[nodiscard]] bool attached() const noexcept { return number_ != 0; }
  /// A command to the instance, without the number of the session; its answer.
  [[nodiscard]] Result<nlohmann::json> command(const std::string& text);
  /// The state, which also tells the instance that this debugger is there. wrong_state: the session is over.
  /// corrupt: the host tells what can be none.
  [[nodiscard]] Result<nlohmann::json> state();

  /// The variables that a pattern names, with their values.
  [[nodiscard]] Result<std::vector<ListedVariable>> variables(const std::string& pattern) {
    return listed({.patterns = {pattern}});
  }
  /// All that a query means, with their values. However many requests it takes, the instance gets a sign of
  /// this debugger each second.
  [[nodiscard]] Result<std::vector<ListedVariable>> listed(VariableQuery query);
  /// The variables that are of no program. Of an application that tells no programs: those without a dot in
  /// their names.
  [[nodiscard]] Result<std::vector<ListedVariable>> globals();
  /// The variable that a name means in a frame of `instance` (its path; empty: none): one of its own, else
  /// one by its whole name. not_found: there is none.
  [[nodiscard]] Result<ListedVariable> variable(const std::string& instance, const std::string& name);
  /// Writes the variable that a name means in a frame of `instance`; its whole name.
  [[nodiscard]] Result<std::string> write(const std::string& instance, const std::string& name,
                                          const std::string& value);

  /// Writes a local variable of a call of a task that halts; 0 is where it halts.
  [[nodiscard]] Result<void> write_local(const std::string& task, std::int64_t frame, const std::string& name,
                                         const std::string& value);

 private:
  [[nodiscard]] Result<DebugPart> part(std::size_t offset);
  /// Tells the instance that this debugger is there, if it has not heard so for a second.
  [[nodiscard]] Result<void> stay();
  /// Nothing: it has changed in between.
  [[nodiscard]] Result<std::optional<std::string>> whole_state();

  DebugRequests requests_;
  std::string host_;
  std::string instance_;
  std::uint64_t number_ = 0;
  TimePoint seen_;  // by the instance
};

}  // namespace plchost
