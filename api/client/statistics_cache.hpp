#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include <control.h>

#include "api/dds/host_writers.hpp"
#include "api/dds/topics.hpp"

namespace plchost {

/// The statistics of one task: a sample without its `ext`, whose bars outlive the loan. Copies share the
/// bars.
class StatisticsReport {
 public:
  explicit StatisticsReport(const plc_TaskStatistics& sample);
  [[nodiscard]] const plc_TaskStatistics& sample() const noexcept { return sample_; }

 private:
  plc_TaskStatistics sample_;
  std::shared_ptr<const std::vector<std::vector<plc_HistogramBar>>> bars_;  // of each histogram
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
