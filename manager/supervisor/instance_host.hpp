#pragma once

#include <optional>
#include <string>
#include <vector>

#include "instances/launch/launch_contract.hpp"
#include "manager/supervisor/starvation_watch.hpp"
#include "manager/system/child_process.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/process/work_limit.hpp"
#include "shm/sockets/control_message.hpp"

namespace plchost {

/// The world of a ManagedInstance: processes, sockets, time. Of one instance. Nothing in it waits; a longer
/// action ends with an InstanceEvents call, never from inside one of these functions.
class InstanceHost {
 public:
  virtual ~InstanceHost() = default;
  /// Starts a process; the result is its pid. Then on_report() until it is ready, and on_exit() at its end.
  [[nodiscard]] virtual Result<int> spawn(const LaunchOptions& options) = 0;
  /// Takes over a process that answers on the instance's socket: its pid. unavailable: there is none.
  [[nodiscard]] virtual Result<int> adopt() = 0;
  /// Sends a request to the process, over a connection that is made when it is first needed; then on_reply().
  [[nodiscard]] virtual Result<void> request(const ControlRequest& request) = 0;
  /// Requests that the process has not taken yet are void: it never does.
  virtual void forget_requests() = 0;
  /// Signals the process, if there is one.
  virtual void signal(int signal) = 0;
  /// Calls on_timer() at that time instead of any earlier setting; nothing: not at all.
  virtual void set_timer(std::optional<TimePoint> when) = 0;
  /// Has an application tried by a process of its own as spawn() would start it, with a time limit; then
  /// on_application_checked().
  [[nodiscard]] virtual Result<void> check_application(const LaunchOptions& options) = 0;
  /// The process's report in its page; nothing if it has made none yet.
  [[nodiscard]] virtual std::optional<InstanceRuntime> runtime() = 0;
  /// There is no process: the report of the last one, if it has left its page.
  [[nodiscard]] virtual std::optional<InstanceRuntime> left_runtime() const = 0;
  /// The processor time that the process wants of its core, and gets now. Reads a file for each of its
  /// threads.
  [[nodiscard]] virtual ProcessorUse processor_use() = 0;
  /// Since its start, with the processes that it has started. Reads a file for each of their threads.
  [[nodiscard]] virtual ProcessorShare processor_share() = 0;
  /// The program that has the process's core now, as a sentence names it; empty: none is seen. Reads a file
  /// for each thread of the host.
  [[nodiscard]] virtual std::string processor_taker() = 0;
  /// The cores that the kernel lets the process's threads run on.
  [[nodiscard]] virtual std::vector<int> granted_cores() = 0;
  /// Writes down the faults that the process shows in its page and cannot write down itself. In words the
  /// last one; empty: it shows none.
  [[nodiscard]] virtual std::string keep_lost_faults() = 0;
  /// The process runs a debug build, and a debugger can halt its tasks.
  [[nodiscard]] virtual bool can_be_debugged() const = 0;
  /// Takes back all that a process which has ended has shown to others. Its outputs go into their safe state.
  /// Its events take no posts, and no debugger is shown its tasks any more.
  virtual void withdraw() = 0;
  /// Takes the output of the process into the instance's log. To be called periodically.
  virtual void read_output() = 0;
  /// The last line that the process has said, of a longer one the last 500 bytes; empty: it has said nothing.
  [[nodiscard]] virtual std::string last_line() const = 0;
  /// The kernel has refused the process a thread or a process for its pids_max.
  [[nodiscard]] virtual bool has_met_pids_max() const = 0;
};

/// The events of an instance.
class InstanceEvents {
 public:
  virtual ~InstanceEvents() = default;
  virtual void on_report(const SetupReport& report) = 0;
  virtual void on_reply(const ControlReply& reply) = 0;
  virtual void on_exit(const ExitStatus& status) = 0;
  virtual void on_timer() = 0;
  virtual void on_application_checked(const Result<void>& result) = 0;
};

}  // namespace plchost
