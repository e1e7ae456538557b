#include "api/client/statistics_cache.hpp"

#include <algorithm>

#include "api/dds/host_writers.hpp"
#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"

namespace plchost {

namespace {

/// Copies a histogram and takes it out of the sample.
HistogramReport take_out(plc_DurationHistogram& sample) {
  HistogramReport report;
  report.total = sample.total;
  std::ranges::copy(sample.percentiles_ns, report.percentiles_ns.begin());
  const auto bars = dds::parts_of(sample.bars);
  report.bars.assign(bars.begin(), bars.end());
  sample = {};
  return report;
}

StatisticsReport to_report(const plc_TaskStatistics& sample) {
  StatisticsReport report;
  report.numbers = sample;
  report.numbers.ext = {};
  report.latency = take_out(report.numbers.latency_histogram);
  report.execution = take_out(report.numbers.execution_histogram);
  report.release_jitter = take_out(report.numbers.release_jitter_histogram);
  report.jitter_negative = take_out(report.numbers.jitter_negative_histogram);
  report.jitter_positive = take_out(report.numbers.jitter_positive_histogram);
  return report;
}

}  // namespace

void StatisticsCache::update() {
  if (!from_) return;
  dds::take_changes<plc_TaskStatistics>(
      from_.reader.get(), writers_,
      [this](dds_instance_handle_t handle, const plc_TaskStatistics& sample) {
        reports_[handle] = to_report(sample);
      },
      [this](dds_instance_handle_t handle, dds::InstanceEnd /*why*/) { reports_.erase(handle); });
}

std::optional<StatisticsReport> StatisticsCache::find(std::string_view host, std::uint64_t epoch,
                                                      std::string_view instance,
                                                      std::string_view task) const {
  for (const auto& [handle, report] : reports_) {
    const plc_TaskStatistics& numbers = report.numbers;
    if (numbers.epoch == epoch && dds::text_of(numbers.host) == host &&
        dds::text_of(numbers.instance) == instance && dds::text_of(numbers.task) == task) {
      return report;
    }
  }
  return std::nullopt;
}

}  // namespace plchost
