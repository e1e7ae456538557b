#include "api/server/status/statistics_writer.hpp"

#include <algorithm>
#include <iterator>
#include <type_traits>
#include <vector>

#include "api/dds/host_writers.hpp"
#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"
#include "shm/base/histogram_digest.hpp"
#include "shm/base/wrapping.hpp"

namespace plchost {

namespace {

/// The histograms of a sample. Their bars live here until it is written.
class Histograms {
 public:
  void put(plc_DurationHistogram& into, const HistogramDigest& digest) {
    into.total = digest.total();
    static_assert(std::extent_v<decltype(into.percentiles_ns)> == HistogramDigest::kFractions.size());
    std::ranges::transform(digest.percentiles(), std::begin(into.percentiles_ns), &Duration::count);
    std::vector<plc_HistogramBar>& bars = bars_.emplace_back();
    for (const auto& bar : digest.bars()) bars.push_back({.lower_ns = bar.lower.count(), .count = bar.count});
    dds::lend(into.bars, bars);
  }

 private:
  std::vector<std::vector<plc_HistogramBar>> bars_;  // of each
};

std::uint32_t share_ppm(std::int64_t part, std::int64_t whole) noexcept {
  if (part <= 0 || whole <= 0) return 0;
  const double share = 1e6 * static_cast<double>(part) / static_cast<double>(whole);
  return static_cast<std::uint32_t>(std::min(share, 1e6));
}

// Nothing was lost: all 0.
plc_CycleLoss to_sample(const CycleLoss& loss) noexcept {
  if (loss.lost == 0) return {};
  const std::int64_t now_ns = MonotonicClock::now().time_since_epoch().count();
  const std::int64_t ahead = wrapping_difference(unix_time_ns(), now_ns);
  const auto unix = [ahead](std::int64_t time_ns) {
    return time_ns == 0 ? 0 : wrapping_difference(ahead, wrapping_difference(0, time_ns));
  };
  return {.lost = loss.lost,
          .release_unix_ns = unix(loss.release_ns),
          .start_unix_ns = unix(loss.start_ns),
          .end_unix_ns = unix(loss.end_ns)};
}

void put_counters(const TaskCounters& counters, TimePoint now, plc_TaskStatistics& sample) noexcept {
  sample.since_unix_ns = counters.since_unix_ns;
  sample.elapsed_ns = wrapping_difference(now.time_since_epoch().count(), counters.since_ns);
  sample.cycles = counters.cycles;
  sample.recorded = counters.recorded;
  sample.lost_cycles = counters.lost_cycles;
  sample.lost_consecutive = counters.lost_consecutive;
  sample.lost_consecutive_max = counters.lost_consecutive_max;
  sample.last_loss = to_sample(counters.last_loss);
  sample.lost_events = counters.lost_events;
  sample.slots_last = counters.slots_last;
  sample.slots_max = counters.slots_max;
  sample.spin_sum_ns = counters.spin_sum_ns;
  sample.spin_ppm = share_ppm(counters.spin_sum_ns, sample.elapsed_ns);
  sample.latency = {counters.latency_last_ns, counters.latency_min_ns, counters.latency_max_ns,
                    average(counters.latency_sum_ns, counters.recorded)};
  sample.execution = {counters.exec_last_ns, counters.exec_min_ns, counters.exec_max_ns,
                      average(counters.exec_sum_ns, counters.recorded)};
  sample.period_jitter = {counters.jitter_last_ns, counters.jitter_min_ns, counters.jitter_max_ns,
                          average(counters.jitter_sum_ns, counters.periods)};
  const std::int64_t least = sample.latency.min_ns;
  sample.release_jitter = {wrapping_difference(sample.latency.last_ns, least), 0,
                           wrapping_difference(sample.latency.max_ns, least),
                           wrapping_difference(sample.latency.average_ns, least)};
}

}  // namespace

bool StatisticsWriter::write(const std::string& instance, const InstancePageReader& page, std::uint32_t index,
                             Told& told) {
  const std::uint64_t sequence = page.task_sequence(index);
  if (!told.task.empty() && told.sequence == sequence) return false;
  const TimePoint now = MonotonicClock::now();
  if (now < refused_until_) return false;
  const auto task = page.task(index);
  if (!task) return false;
  const TaskCounters& counters = task->counters;
  plc_TaskStatistics sample{};
  dds::copy_text(sample.host, host_);
  dds::copy_text(sample.instance, instance);
  dds::copy_text(sample.task, task->identity.name.view());
  sample.epoch = epoch_;
  sample.digits = page.histogram_shape().digits();
  put_counters(counters, now, sample);
  const auto digest_of = [&](TaskHistogram which, std::int64_t least_ns, std::int64_t greatest_ns) {
    return HistogramDigest(page.histogram(index, which), Duration(least_ns), Duration(greatest_ns));
  };
  const HistogramDigest latency =
      digest_of(TaskHistogram::latency, counters.latency_min_ns, counters.latency_max_ns);
  Histograms histograms;
  histograms.put(sample.latency_histogram, latency);
  histograms.put(sample.execution_histogram,
                 digest_of(TaskHistogram::execution, counters.exec_min_ns, counters.exec_max_ns));
  histograms.put(sample.release_jitter_histogram,
                 latency.above_least(page.histogram(index, TaskHistogram::latency),
                                     Duration(counters.latency_min_ns), Duration(counters.latency_max_ns)));
  histograms.put(sample.jitter_negative_histogram, digest_of(TaskHistogram::jitter_negative, 0,
                                                             wrapping_difference(0, counters.jitter_min_ns)));
  histograms.put(sample.jitter_positive_histogram,
                 digest_of(TaskHistogram::jitter_positive, 0, counters.jitter_max_ns));
  if (dds_write(way_.writer.get(), &sample) != DDS_RETCODE_OK) {
    refused_until_ = now + kPause;
    return true;
  }
  told = {.task = std::string(task->identity.name.view()),
          .sequence = sequence,
          .since_ns = counters.since_ns,
          .latency_p50 = latency.percentiles()[0],
          .latency_p99 = latency.percentiles()[2]};
  return true;
}

void StatisticsWriter::dispose(const std::string& instance, const Told& told) {
  if (told.task.empty()) return;
  plc_TaskStatistics sample{};
  dds::copy_text(sample.host, host_);
  dds::copy_text(sample.instance, instance);
  dds::copy_text(sample.task, told.task);
  dds::end_row(way_.writer.get(), sample);
}

}  // namespace plchost
