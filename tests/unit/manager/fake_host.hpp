#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "manager/supervisor/instance_host.hpp"

namespace plchost {

/// The world of one instance, in the hands of a test.
class FakeHost : public InstanceHost {
 public:
  [[nodiscard]] Result<int> spawn(const LaunchOptions& options) override {
    if (!can_spawn) return failure(ErrorCode::system, "start plc-instance", spawn_errno);
    spawned.push_back(options);
    return next_pid++;
  }
  [[nodiscard]] Result<int> adopt() override {
    if (!adoptable) return failure(ErrorCode::unavailable, "nobody is there");
    return *adoptable;
  }
  [[nodiscard]] Result<void> request(const ControlRequest& request) override {
    if (!can_send) return failure(ErrorCode::unavailable, "nobody listens");
    requests.push_back(request);
    return {};
  }
  void forget_requests() override { ++forgotten; }
  void signal(int signal) override { signals.push_back(signal); }
  void set_timer(std::optional<TimePoint> when) override { timer = when; }
  [[nodiscard]] Result<void> check_application(const LaunchOptions& options) override {
    checked.push_back(options.application);
    launch_checked = options;
    return {};
  }
  [[nodiscard]] std::optional<InstanceRuntime> runtime() override { return page; }
  [[nodiscard]] std::optional<InstanceRuntime> left_runtime() const override { return left; }
  [[nodiscard]] ProcessorUse processor_use() override { return use; }
  [[nodiscard]] ProcessorShare processor_share() override { return share; }
  [[nodiscard]] std::string processor_taker() override { return taker; }
  [[nodiscard]] std::vector<int> granted_cores() override { return cores; }
  [[nodiscard]] std::string keep_lost_faults() override { return lost_fault; }
  [[nodiscard]] bool can_be_debugged() const override { return debug_build; }
  void withdraw() override { ++ended_outputs; }
  void read_output() override {}
  [[nodiscard]] std::string last_line() const override { return said; }
  [[nodiscard]] bool has_met_pids_max() const override { return met_pids_max; }

  std::vector<LaunchOptions> spawned;
  std::vector<ControlRequest> requests;
  std::vector<int> signals;
  std::vector<std::string> checked;
  LaunchOptions launch_checked;  // the last one
  std::optional<TimePoint> timer;
  std::optional<InstanceRuntime> page;
  std::optional<InstanceRuntime> left;  // by a process that has ended
  std::optional<int> adoptable;
  ProcessorUse use;
  ProcessorShare share;
  std::string taker = "program 'hog' (process 7, SCHED_FIFO 50)";
  std::vector<int> cores = {1};
  bool can_spawn = true;
  int spawn_errno = 0;
  bool can_send = true;
  std::string lost_fault;
  bool debug_build = false;
  int ended_outputs = 0;
  int forgotten = 0;
  std::string said;
  bool met_pids_max = false;
  int next_pid = 100;
};

inline ExitStatus killed_by(int signal) {
  return {.kind = ExitStatus::Kind::killed, .value = signal};
}
inline ExitStatus exited_with(int code) {
  return {.kind = ExitStatus::Kind::exited, .value = code};
}

}  // namespace plchost
