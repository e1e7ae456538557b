#include "api/server/status/statistics_writer.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <span>

#include "api/dds/host_writers.hpp"
#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"
#include "shm/base/histogram_digest.hpp"
#include "shm/base/wrapping.hpp"

namespace plchost {

namespace {

using Bars = std::array<plc_HistogramBar, HistogramDigest::kMaxBars>;

/// A histogram as the topic has it. The bars live here until the sample is written.
class Histogram {
 public:
  Histogram(const HistogramView& view, std::int64_t least_ns, std::int64_t greatest_ns)
      : Histogram(HistogramDigest(view, Duration(least_ns), Duration(greatest_ns))) {}
  explicit Histogram(const HistogramDigest& digest) : digest_(digest) {
    for (std::size_t i = 0; i < digest_.bars().size(); ++i) {
      const auto& bar = digest_.bars()[i];
      bars_[i] = {.lower_ns = bar.lower.count(), .count = bar.count};
    }
  }
  Histogram(const Histogram&) = delete;
  Histogram& operator=(const Histogram&) = delete;

  void put_into(plc_DurationHistogram& sample) {
    sample.total = digest_.total();
    static_assert(std::extent_v<decltype(sample.percentiles_ns)> == HistogramDigest::kFractions.size());
    std::ranges::transform(digest_.percentiles(), std::begin(sample.percentiles_ns), &Duration::count);
    dds::lend(sample.bars, std::span(bars_).first(digest_.bars().size()));
  }
  [[nodiscard]] const HistogramDigest& digest() const noexcept { return digest_; }

 private:
  HistogramDigest digest_;
  Bars bars_{};
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
  const auto read = [&](TaskHistogram which) { return page.histogram(index, which); };
  Histogram latency(read(TaskHistogram::latency), counters.latency_min_ns, counters.latency_max_ns);
  Histogram execution(read(TaskHistogram::execution), counters.exec_min_ns, counters.exec_max_ns);
  Histogram negative(read(TaskHistogram::jitter_negative), 0, wrapping_difference(0, counters.jitter_min_ns));
  Histogram positive(read(TaskHistogram::jitter_positive), 0, counters.jitter_max_ns);
  Histogram release_jitter(latency.digest().above_least(
      read(TaskHistogram::latency), Duration(counters.latency_min_ns), Duration(counters.latency_max_ns)));
  latency.put_into(sample.latency_histogram);
  execution.put_into(sample.execution_histogram);
  release_jitter.put_into(sample.release_jitter_histogram);
  negative.put_into(sample.jitter_negative_histogram);
  positive.put_into(sample.jitter_positive_histogram);
  if (dds_write(way_.writer.get(), &sample) != DDS_RETCODE_OK) {
    refused_until_ = now + kPause;
    return true;
  }
  told = {.task = std::string(task->identity.name.view()),
          .sequence = sequence,
          .since_ns = counters.since_ns,
          .latency_p50 = latency.digest().percentiles()[0],
          .latency_p99 = latency.digest().percentiles()[2]};
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
