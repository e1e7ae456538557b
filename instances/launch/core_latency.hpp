#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

// The wake-up latency of one core, held at 0
// ==========================================
//
// SYSFS/devices/system/cpu/cpuN/power/pm_qos_resume_latency_us says how long core N may take to wake up: "0"
// is no limit, "n/a" is no latency at all. Unlike /dev/cpu_dma_latency it does not end with the process that
// wrote it, so the value before is written down first, in "RUN_DIRECTORY/coreN.latency". Each holder has a
// shared lock on that record, which the kernel takes back when the process ends, however it ends. So a record
// without a holder is a hold that nobody wants any more. The last holder puts the value back and removes the
// record; for one that was killed, the manager does, or the next instance with that run directory.

/// Where the kernel's files are: "/sys", or a folder that a test has made.
inline constexpr std::string_view kSysfs = "/sys";

/// A core's latency, held at 0 as long as this exists. Set-up.
class CoreLatencyHold {
 public:
  /// unsupported: the kernel has no such file; refused, system: it may not be read or written. On failure
  /// nothing is held.
  [[nodiscard]] static Result<CoreLatencyHold> take(const std::string& sysfs,
                                                    const std::string& run_directory, int core);
  CoreLatencyHold(CoreLatencyHold&& other) noexcept = default;
  CoreLatencyHold& operator=(CoreLatencyHold&& other) noexcept = delete;
  CoreLatencyHold(const CoreLatencyHold&) = delete;
  CoreLatencyHold& operator=(const CoreLatencyHold&) = delete;
  /// Puts back what was there before, unless another process holds the same core.
  ~CoreLatencyHold();

  [[nodiscard]] int core() const noexcept { return core_; }

 private:
  CoreLatencyHold(std::string sysfs, std::string run_directory, int core, UniqueFd record) noexcept
      : sysfs_(std::move(sysfs)),
        run_directory_(std::move(run_directory)),
        core_(core),
        record_(std::move(record)) {}

  std::string sysfs_;
  std::string run_directory_;
  int core_;
  UniqueFd record_;
};

/// Puts back what processes that are gone have held, and returns what was done, one line each, for the log.
/// busy: another process is taking or giving back a hold at this moment; try again later. Never waits.
[[nodiscard]] Result<std::vector<std::string>> restore_core_latency(const std::string& sysfs,
                                                                    const std::string& run_directory);

}  // namespace plchost
