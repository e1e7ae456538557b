#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "schedulers/settings/scheduler_settings.hpp"
#include "schedulers/tasks/task_config.hpp"

namespace plchost {

/// How long a cycle may take before it is stopped in its middle; nothing: as long as it likes. Pure.
struct CycleLimit {
  Duration limit{};
  /// The guard against endless loops that tasks without a watchdog of their own have: the processor time of
  /// the thread counts, or the time for which the cycle waits. Time in which the process stood still, or
  /// others had the processor, does not.
  bool lenient = false;
  bool operator==(const CycleLimit&) const = default;
};
[[nodiscard]] std::optional<CycleLimit> cycle_limit(const TaskConfig& task,
                                                    const WatchdogSettings& settings) noexcept;
/// The guard against endless loops is as long as the task's interval, but at most so many times its own time.
inline constexpr int kMostStretch = 10;
/// The limits in force, one line for each that there is, with the tasks that have it.
[[nodiscard]] std::vector<std::string> describe_cycle_limits(std::span<const TaskConfig> tasks,
                                                             const WatchdogSettings& settings);

/// The guard against overload hits above this share of the core. The kernel takes it from real-time threads
/// for 5 % of each second, if it is set as it comes; something else may run on it, too.
inline constexpr int kOverloadPercent = 90;

/// The processor load of an instance, window by window. The time of some tasks does not count. One thread.
class LoadRule {
 public:
  struct Sample {
    Duration process;                 ///< CPU time of the whole process since its start
    std::span<const Duration> tasks;  ///< of each task's thread; in the order given to the constructor
  };
  struct Hit {
    int percent;
    std::size_t task;  ///< that used the most
  };

  /// `left_out`: for each task, whether what it uses does not count.
  explicit LoadRule(std::vector<bool> left_out) : left_out_(std::move(left_out)) {}

  /// A window begins with this sample.
  void begin(TimePoint now, const Sample& sample);
  /// A window ends, and the next one begins. `cores`: how many the instance may use. Hits above `maximum`
  /// percent of one core; of several cores, if one thread alone or all together on average use more of one.
  [[nodiscard]] std::optional<Hit> end(TimePoint now, const Sample& sample, int maximum, int cores);

 private:
  std::vector<bool> left_out_;
  TimePoint begun_;
  Duration process_{};
  std::vector<Duration> tasks_;
};

}  // namespace plchost
