#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include <control.h>

#include "api/dds/host_writers.hpp"
#include "api/dds/topics.hpp"

namespace plchost {

/// A histogram as it came: percentiles in the order of the topic (50, 90, 99, 99.9, 99.99 %).
struct HistogramReport {
  std::uint64_t total = 0;
  std::array<std::int64_t, 5> percentiles_ns{};
  std::vector<plc_HistogramBar> bars;  ///< ascending
};

/// The statistics of one task.
struct StatisticsReport {
  plc_TaskStatistics numbers{};  ///< without the histograms
  HistogramReport latency;
  HistogramReport execution;
  HistogramReport release_jitter;
  HistogramReport jitter_negative;
  HistogramReport jitter_positive;
};

/// The newest statistics of each task. Beside StatusCache, because these samples have parts that live on loan
/// only.
class StatisticsCache {
 public:
  StatisticsCache() = default;
  explicit StatisticsCache(dds::TopicReader from) noexcept : from_(std::move(from)) {}

  [[nodiscard]] explicit operator bool() const noexcept { return static_cast<bool>(from_); }
  /// Takes what has come.
  void update();
  /// Of that task, if the host's present server wrote it.
  [[nodiscard]] std::optional<StatisticsReport> find(std::string_view host, std::uint64_t epoch,
                                                     std::string_view instance, std::string_view task) const;

 private:
  dds::TopicReader from_;
  dds::HostWriters writers_;
  std::map<dds_instance_handle_t, StatisticsReport> reports_;
};

}  // namespace plchost
