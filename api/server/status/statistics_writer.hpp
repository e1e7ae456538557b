#pragma once

#include <cstdint>
#include <string>

#include <control.h>

#include "api/dds/topics.hpp"
#include "shm/base/time.hpp"
#include "shm/pages/instance_page.hpp"

namespace plchost {

/// Writes the topic of task statistics from the instances' pages. Control loop only.
class StatisticsWriter {
 public:
  /// The last published statistics of one task.
  struct Told {
    std::string task;            ///< empty: nothing yet
    std::uint64_t sequence = 0;  ///< of the page's counters then
    std::int64_t since_ns = 0;   ///< of the reset before
    Duration latency_p50{};
    Duration latency_p99{};
  };

  /// A reader that is too slow makes a write wait a millisecond: after that nothing is written for so long.
  static constexpr Duration kPause = std::chrono::milliseconds(20);

  StatisticsWriter(std::string host, std::uint64_t epoch, dds::TopicWriter way)
      : host_(std::move(host)), epoch_(epoch), way_(std::move(way)) {}

  /// Writes task `index` of `page` if there is news since `told`, and takes that down in it. A sample that
  /// the writer refuses stays news. The cost is that of reading the buckets of what was recorded, up to 360
  /// KB; false: there was no news, and no such cost.
  bool write(const std::string& instance, const InstancePageReader& page, std::uint32_t index, Told& told);

  /// The task is gone.
  void dispose(const std::string& instance, const Told& told);

 private:
  std::string host_;
  std::uint64_t epoch_;
  dds::TopicWriter way_;
  TimePoint refused_until_;
};

}  // namespace plchost
