#pragma once

#include <cstdint>
#include <vector>

#include "manager/config/manager_config.hpp"
#include "manager/system/child_process.hpp"
#include "shm/base/time.hpp"

namespace plchost {

// The decision after each end of an instance
// ==========================================
//
// decide() is the one place. Its table lists each way in which an instance ends or cannot begin, and what the
// manager does under each restart policy. These rules override the policy, and each rule those below it:
//
//   1. If a new application does not come up, the manager starts the one that ran before it.
//   2. An operator's stop overrides any start but an operator's. An instance that an operator stopped
//      while it had no process stays without one. An application that an operator stopped stays stopped in
//      each new process.
//   3. The manager restarts no instance that was removed from the configuration.
//   4. When a manager begins, an instance that no operator has started or stopped follows `autostart`.
//   5. `autostart` begins an instance with its host under each policy, also under `never`.
//
// An end that nobody asked this manager for is a crash, whatever the exit code: exit(0) in a cycle is one.
// A set-up that failed is no crash. on_failure does not repeat it, because the same files would fail again.
// It does repeat it when the host was short of something, or when a process of that name is there already.
// After crash_limit crashes within crash_window, the next process starts without the application: safe mode.
// Safe mode lasts until an operator's load, reset or restart, or until another application is configured.

/// Every way in which an instance ends or does not begin.
enum class EndCause : std::uint8_t {
  // The process has ended by itself.
  exited,     ///< with any code
  killed,     ///< by a signal that this manager did not send
  unknown,    ///< it was no child of this manager
  unwatched,  ///< while no manager ran, or before this one knew whether it was to run
  // The process could not be started.
  start_refused,      ///< wrong files or settings, or not ready in time
  start_transient,    ///< the host was short of something, or a lock was held
  declaration_taken,  ///< another process has an output or a node address that the start needs
  limit_met,          ///< it needs more threads and processes than its pids_max
  name_taken,         ///< a process of that name is there already
  // The process is there, but its application does not run, or its state is not known.
  exception,            ///< a fault has stopped the application
  silent,               ///< the control thread does not answer
  adoption_unanswered,  ///< an adopted process does not answer
  idle,                 ///< the application is stopped, or the process waits for its start
  // An operator or the manager has asked for the end.
  operators_stop,   ///< of an instance that has a process
  stop_of_waiting,  ///< of an instance that waits for its start
  replaced,         ///< by reset, restart or load; the operator says how the next process begins
  told_to_end,      ///< it was removed, and has ended
  manager_ends,     ///< in order
  // A manager begins, or reads its configuration again, and the instance has no process.
  never_begun,         ///< no earlier manager has left anything of it
  without_process,     ///< nothing was running
  setting_up_unknown,  ///< its process was being set up when the manager ended
  host_ended,          ///< in order, or by a power cut
  given_up,            ///< failed before
  wish_unreadable,     ///< its wish is not known
  reconfigured,        ///< the configuration has it again, or changes what made it fail
};
inline constexpr std::uint8_t kEndCauses = static_cast<std::uint8_t>(EndCause::reconfigured) + 1;

/// How an operator last wanted the instance.
enum class Order : std::uint8_t {
  none,        ///< no operator has said anything
  run,         ///< the application runs
  stop,        ///< the application stays stopped
  no_process,  ///< the instance stays without a process
};

/// The facts that count about one end. Time comes in from outside.
struct End {
  EndCause cause = EndCause::exited;
  Order order = Order::none;
  TimePoint at{};
  Duration lasted{};         ///< the process was up for so long; zero: it never came up
  bool removed = false;      ///< the configuration has no such instance any more
  bool has_earlier = false;  ///< the new application has not come up, and the one before it ran
};

/// The ends so far, which lead to a longer back-off and to safe mode. Besides decide(), three functions of
/// ManagedInstance write it: restore(), learn() of an adopted process, and use_configuration() when that
/// names another application.
struct RestartHistory {
  std::vector<TimePoint> crashes;  ///< within crash_window, the oldest first; at most crash_limit
  std::uint32_t in_a_row = 0;      ///< ends since the instance was last up for a whole crash_window
  bool safe_mode = false;          ///< the next process, or this one, has no application

  bool operator==(const RestartHistory&) const = default;
};

/// The manager's answer to the end of a process.
struct Decision {
  enum class Action : std::uint8_t {
    leave,           ///< nothing: process and application stay as they are
    start_now,       ///< a new process
    start_earlier,   ///< a new process with the application that ran before
    start_in_order,  ///< a new process as soon as the instances of `after` are up
    back_off,        ///< a new process after `delay`
    await_process,   ///< no new process, but the one that is being set up is looked for
    bring_down,      ///< the process ends; then it stays without one
    go_offline,      ///< it stays without a process
    fail,            ///< it stays without a process, and says why
  };
  Action action = Action::leave;
  bool runs = true;    ///< the application begins by itself in the next process
  Duration delay{};    ///< of back_off; of await_process: the interval of the looks for it
  bool crash = false;  ///< the end counts towards safe mode
  RestartHistory history;

  bool operator==(const Decision&) const = default;
};

/// The decision after `end`. Pure. `policy`: restart, autostart, the delays and the limits count.
[[nodiscard]] Decision decide(const End& end, const RestartHistory& history, const InstanceConfig& policy);

/// Why a process ended that nobody asked to end.
[[nodiscard]] EndCause cause_of(const ExitStatus& status) noexcept;

/// The history that another manager has left: how long ago each crash was, the oldest first.
[[nodiscard]] RestartHistory restored_history(TimePoint now, const std::vector<Duration>& ages,
                                              std::uint32_t in_a_row, bool safe_mode,
                                              const InstanceConfig& policy);

}  // namespace plchost
