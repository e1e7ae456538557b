#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "api/cli/top/plant_look.hpp"
#include "api/cli/top/trend.hpp"
#include "api/dds/text.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The 99th percentile of what came between two samples of one histogram, in nanoseconds: the lower edge of
/// its bar. A histogram that began anew meanwhile counts from its begin. Nothing: nothing came.
[[nodiscard]] std::optional<std::int64_t> percentile_between(const plc_DurationHistogram& before,
                                                             const plc_DurationHistogram& now);

/// The counters of a task over the last seconds.
struct TaskFigures {
  double cycles_per_s = 0;
  double load_percent = 0;  ///< of a core: its cycles by their average execution
  std::optional<std::int64_t>
      latency_p99_ns;  ///< of the last interval; only of an instance that is looked into
  Trend latency;       ///< the same over time, in nanoseconds
};

struct LoadFigures {
  double load_percent = 0;
  Trend load;
};

/// The figures between looks, of all tasks, instances and cores. Those of things that are gone are forgotten.
class TopFigures {
 public:
  /// Rates are of so long: a host shows the counters of a task 5 times a second, so those of a moment would
  /// be wrong by a fifth.
  static constexpr Duration kWindow = std::chrono::seconds(5);

  /// "host/instance/task", "host/instance", and "host/core".
  using Name = std::string;
  [[nodiscard]] static Name name_of(const plc_TaskStatus& task);
  /// Of the instance that a sample is about.
  template <class Sample>
  [[nodiscard]] static Name instance_of(const Sample& sample) {
    return fmt::format("{}/{}", dds::text_of(sample.host), dds::text_of(sample.instance));
  }
  [[nodiscard]] static Name name_of_core(const std::string& host, std::int32_t core);

  void take(const std::vector<HostLook>& hosts, TimePoint now);
  void take(const InstanceStatistics& statistics);

  [[nodiscard]] const TaskFigures& task(const Name& name) const;
  [[nodiscard]] const LoadFigures& instance(const Name& name) const;
  [[nodiscard]] const LoadFigures& core(const Name& name) const;

 private:
  struct Counted {
    std::uint64_t epoch = 0;
    std::deque<std::pair<TimePoint, std::uint64_t>>
        cycles;  // of the looks within kWindow, the last one first
    std::optional<StatisticsReport> statistics;
    TaskFigures figures;
  };
  static void count(Counted& task, const plc_TaskStatus& status, TimePoint now);

  std::map<Name, Counted> tasks_;
  std::map<Name, LoadFigures> instances_;
  std::map<Name, LoadFigures> cores_;
};

}  // namespace plchost
