#pragma once

#include <string>
#include <vector>

#include "instances/launch/core_latency.hpp"
#include "instances/runtime/settings/settings.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

/// Idle cores held awake, as long as this exists. Set-up.
class IdleHold {
 public:
  /// Where the kernel's files are; a test makes its own.
  struct Files {
    std::string sysfs = std::string(kSysfs);
    std::string device = "/dev/cpu_dma_latency";
  };

  IdleHold() = default;
  /// Holds idle states off as far as the kernel allows. status() returns the result. If the kernel cannot
  /// hold a single core, or there is no run directory for the value before, hold_core holds all cores
  /// instead.
  [[nodiscard]] static IdleHold take(IdleStates wanted, const std::vector<int>& cores,
                                     const std::string& run_directory, const Files& files);

  /// "held for all cores", "held for core 1", "allowed", "not held: ...", with the reason where it is not
  /// what was wanted.
  [[nodiscard]] const std::string& status() const noexcept { return status_; }
  /// It is what was wanted.
  [[nodiscard]] bool as_wanted() const noexcept { return as_wanted_; }

 private:
  void hold_all(const std::string& device);

  UniqueFd device_;  // /dev/cpu_dma_latency: 0 while it is open, so it ends with the process
  std::vector<CoreLatencyHold> cores_;
  std::string status_ = "allowed";
  bool as_wanted_ = true;
};

}  // namespace plchost
