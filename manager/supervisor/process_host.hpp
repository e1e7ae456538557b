#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "manager/supervisor/instance_host.hpp"
#include "manager/supervisor/instance_output.hpp"
#include "manager/system/application_trial.hpp"
#include "manager/system/child_process.hpp"
#include "manager/system/control_groups.hpp"
#include "manager/system/reactor.hpp"
#include "shm/sockets/packet_socket.hpp"

namespace plchost {

/// The real InstanceHost: one instance's process, with its pidfd, report channel and control socket, in the
/// Reactor. Every exit is reaped in one place, after the manager has read the last messages of the process.
class ProcessHost : public InstanceHost {
 public:
  /// The share of the host that a process may have.
  struct Share {
    GroupLimits limits;
    std::optional<int> oom_score;  ///< nothing: that of the manager
  };
  struct Settings {
    std::string program;  ///< path of plc-instance
    std::string name;
    std::string pool;
    std::string run_directory;
    /// Before each start of a process; may be empty.
    std::function<void()> prepare = {};
    /// After the end of a process: its events take no posts any more.
    std::function<void()> withdraw_events;
    /// The control groups of the host; none: its processes stay in that of the manager.
    ControlGroups* groups = nullptr;
    /// Of the next process; may be empty.
    std::function<Share()> share = {};
    TrialGroup trial_group = {};
  };

  ProcessHost(Reactor& reactor, Settings settings);
  /// Before anything else; outlives this.
  void connect_events(InstanceEvents& events) { events_ = &events; }

  [[nodiscard]] Result<int> spawn(const LaunchOptions& options) override;
  [[nodiscard]] Result<int> adopt() override;
  void forget_requests() override;
  [[nodiscard]] Result<void> request(const ControlRequest& request) override;
  void signal(int signal) override;
  void set_timer(std::optional<TimePoint> when) override;
  [[nodiscard]] Result<void> check_application(const LaunchOptions& options) override;
  [[nodiscard]] std::optional<InstanceRuntime> runtime() override;
  [[nodiscard]] std::optional<InstanceRuntime> left_runtime() const override;
  [[nodiscard]] ProcessorUse processor_use() override;
  [[nodiscard]] ProcessorShare processor_share() override;
  [[nodiscard]] std::string processor_taker() override;
  [[nodiscard]] std::vector<int> granted_cores() override;
  [[nodiscard]] std::string keep_lost_faults() override;
  [[nodiscard]] bool can_be_debugged() const override;
  void withdraw() override;
  void read_output() override;
  [[nodiscard]] std::string last_line() const override { return output_.last_line(); }
  [[nodiscard]] bool has_met_pids_max() const override;

 private:
  /// The folder of its control group; empty: it has none.
  [[nodiscard]] std::string make_group(const GroupLimits& limits);
  [[nodiscard]] bool end_group();
  [[nodiscard]] std::string group_name() const;
  /// A process has the instance's name; its group is not to be ended.
  [[nodiscard]] bool name_is_held() const;
  /// Takes the process over if it can be watched.
  [[nodiscard]] Result<void> follow(ChildProcess& process);
  [[nodiscard]] Result<int> adopt_peer();
  [[nodiscard]] Result<void> connect();
  void read_reports();
  void read_replies();
  void process_ended();
  void forget_process();
  void check_ended();
  void check_timed_out();

  Reactor& reactor_;
  Settings settings_;
  InstanceOutput output_;
  InstanceEvents* events_ = nullptr;
  Reactor::Timer timer_;

  std::optional<ChildProcess> process_;
  Reactor::Watch exit_watch_;
  PacketSocket report_;
  Reactor::Watch report_watch_;
  PacketSocket link_;
  Reactor::Watch link_watch_;
  std::optional<InstancePageReader> page_;

  std::optional<ApplicationTrial> check_;
  Reactor::Watch check_watch_;
  Reactor::Timer check_timer_;
};

}  // namespace plchost
