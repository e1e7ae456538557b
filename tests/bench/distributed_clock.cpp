// A 1 ms task under CmpScheduleOneShot on the grid of a reference clock. That clock drifts by 100 ppm, has
// +-200 ns of noise on each pair of stamps, and is 300 us off at the start. Firmware (a thread on the other
// core) writes the pairs into the reference record. The measurements are held against the reference without
// its noise.

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
#include <thread>

#include <time.h>

#include "schedulers/task_set.hpp"
#include "shm/plc_reference_clock.h"
#include "tests/bench/cycle_log.hpp"
#include "tests/bench/parts.hpp"

namespace plchost::bench {

namespace {

constexpr Duration kSettling = std::chrono::seconds(2);  // the promise; steady state begins there
constexpr Duration kSettled = std::chrono::microseconds(1);
constexpr auto kStopLimit = std::chrono::seconds(10);
constexpr double kDrift = 100e-6;
constexpr double kNoiseNs = 200;
constexpr double kOffAtStartNs = 300'000;

/// The reference's time, against the first release.
class Reference {
 public:
  explicit Reference(TimePoint first_release) : origin_(first_release) {}
  [[nodiscard]] double at(TimePoint when) const {
    return kOffAtStartNs + static_cast<double>((when - origin_).count()) * (1 + kDrift);
  }
  /// How far it is behind the nearest point of the reference grid, in nanoseconds.
  [[nodiscard]] double deviation(TimePoint when) const {
    const auto period = static_cast<double>(kCyclePeriod.count());
    return at(when) - std::round(at(when) / period) * period;
  }

 private:
  TimePoint origin_;
};

/// The record as an instance reads it.
class RecordSource final : public ReferenceSource {
 public:
  explicit RecordSource(const plc_reference_clock& record) noexcept : record_(record) {}
  [[nodiscard]] Reading read() noexcept override {
    plc_reference_reading reading{};
    if (plc_reference_clock_read(&record_, &reading) != PLC_REFERENCE_OK) return {};
    return {.outcome = Outcome::pair,
            .pair = {.local = TimePoint(Duration(reading.local_ns)), .reference_ns = reading.reference_ns},
            .updates = reading.updates};
  }

 private:
  const plc_reference_clock& record_;
};

/// Firmware that writes a pair each millisecond until it goes.
class Firmware {
 public:
  Firmware(plc_reference_clock& record, Reference reference)
      : thread_([this, &record, reference] { run(record, reference); }) {}
  ~Firmware() {
    ending_.store(true);
    thread_.join();
  }
  Firmware(const Firmware&) = delete;
  Firmware& operator=(const Firmware&) = delete;

 private:
  void run(plc_reference_clock& record, const Reference& reference) {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> noise(-kNoiseNs, kNoiseNs);
    for (TimePoint next = MonotonicClock::now(); !ending_.load(); next += kCyclePeriod) {
      const timespec until = to_timespec(next);
      ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
      const TimePoint local = MonotonicClock::now();
      const double shown = reference.at(local) + noise(random);
      plc_reference_clock_write(&record, std::llround(shown), local.time_since_epoch().count(), 1);
    }
  }

  std::atomic<bool> ending_{false};
  std::thread thread_;
};

/// The cycles of one run, and what became of the clock.
struct Run {
  CycleLog log;
  ClockStatus status{};
};

Result<void> run_cycles(const Plan& plan, Duration length, Run& run, std::optional<Reference>& reference) {
  plc_reference_clock record{};
  plc_reference_clock_begin(&record);
  RecordSource source(record);
  LinuxClock clock;
  TaskStatistics statistics;
  std::atomic<std::int64_t> first_release{0};
  TimePoint began{};
  TaskConfig task;
  task.name = "measured";
  task.interval = kCyclePeriod;
  task.entry = [&] { began = MonotonicClock::now(); };
  task.after_cycle = [&](const TaskCounters& counters) {
    run.log.add({TimePoint(Duration(counters.release_ns)), began});
    if (counters.cycles == 1) first_release.store(counters.release_ns);
  };
  TaskEnvironment environment;
  environment.statistics = [&](std::size_t) -> TaskStatistics& { return statistics; };
  Result<std::unique_ptr<TaskSet>> tasks = [&] {
    const OnCore threads_inherit_it(plan.task_core);
    return TaskSet::create(clock, PriorityBand::normal, {task}, environment);
  }();
  if (!tasks) return std::unexpected(std::move(tasks.error()));
  TaskSet& set = **tasks;
  if (!set.distributed_clock().use_source(&source)) return failure(ErrorCode::busy, "the clock is in use");
  const OnCore out_of_the_way(plan.poster_core);
  if (auto started = set.start("CmpScheduleOneShot", {}); !started) return started;
  while (first_release.load() == 0) std::this_thread::sleep_for(kCyclePeriod);
  reference.emplace(TimePoint(Duration(first_release.load())));
  {
    const Firmware firmware(record, *reference);
    std::this_thread::sleep_for(length);
  }
  run.status = set.distributed_clock().status(*set.distributed_clock().leading());
  return set.stop(kStopLimit);
}

Duration magnitude(double ns) {
  return Duration(std::llround(std::abs(ns)));
}

/// Since the first release: from when on the plan stayed within kSettled of the grid.
double settling_ms(std::span<const Cycle> cycles, const Reference& reference) {
  TimePoint last_off = cycles.front().release;
  for (const Cycle& cycle : cycles) {
    if (magnitude(reference.deviation(cycle.release)) > kSettled) last_off = cycle.release;
  }
  return to_us(last_off - cycles.front().release) / 1e3;
}

/// The largest deviation of a planned distance from whole periods.
double largest_correction_us(std::span<const Cycle> cycles) {
  Duration largest{};
  for (std::size_t i = 1; i < cycles.size(); ++i) {
    const Duration distance = cycles[i].release - cycles[i - 1].release;
    const auto periods = (distance + kCyclePeriod / 2) / kCyclePeriod;
    // A release that was lost in between may have been corrected only once: no more than one bound either
    // way.
    largest = std::max(largest, Duration(std::abs((distance - periods * kCyclePeriod).count())));
  }
  return to_us(largest);
}

/// The drawn values of the deviations in a stretch.
enum class Drawn : std::uint8_t { largest, median };

/// One point for each stretch of that length, of the cycles until `end` after the first one.
std::vector<std::pair<double, double>> points_of(std::span<const Cycle> cycles, const Reference& reference,
                                                 TimePoint Cycle::* which, Drawn drawn, Duration length,
                                                 Duration end) {
  std::vector<std::pair<double, double>> points;
  std::vector<double> stretch;
  const TimePoint origin = cycles.front().release;
  TimePoint next = origin + length;
  for (const Cycle& cycle : cycles) {
    if (cycle.release - origin > end) break;
    stretch.push_back(std::abs(reference.deviation(cycle.*which)));
    if (cycle.release < next) continue;
    const auto middle = stretch.begin() + static_cast<std::ptrdiff_t>(stretch.size() / 2);
    std::ranges::nth_element(stretch, middle);
    points.emplace_back(std::chrono::duration<double>(cycle.release - origin).count(),
                        drawn == Drawn::median ? *middle : std::ranges::max(stretch));
    stretch.clear();
    while (next <= cycle.release) next += length;
  }
  return points;
}

/// Two panels, since the largest deviation of a stretch grows with its length: how the plan settles, and the
/// whole run.
std::vector<Series> series_of(std::span<const Cycle> cycles, const Reference& reference) {
  struct Stretches {
    const char* panel;
    Duration length;
    Duration end;
  };
  const std::array panels = {Stretches{.panel = "the first 2 s, in stretches of 10 ms",
                                       .length = std::chrono::milliseconds(10),
                                       .end = kSettling},
                             Stretches{.panel = "the whole run, in stretches of 250 ms",
                                       .length = std::chrono::milliseconds(250),
                                       .end = Duration::max()}};
  std::vector<Series> all;
  for (const Stretches& of : panels) {
    const auto add = [&](const char* name, TimePoint Cycle::* which, Drawn drawn) {
      all.push_back({.name = name,
                     .panel = of.panel,
                     .points = points_of(cycles, reference, which, drawn, of.length, of.end)});
    };
    add("planned release: the largest of a stretch", &Cycle::release, Drawn::largest);
    add("start: the largest of a stretch", &Cycle::start, Drawn::largest);
    add("start: the median of a stretch", &Cycle::start, Drawn::median);
  }
  return all;
}

}  // namespace

Result<std::vector<Row>> measure_distributed_clock(const Plan& plan) {
  const Duration length = plan.each + kSettling;
  Run run{.log = CycleLog(static_cast<std::size_t>(length / kCyclePeriod) * 2 + 10'000)};
  std::optional<Reference> reference;
  PLCHOST_TRY(run_cycles(plan, length, run, reference));
  const auto cycles = run.log.between(TimePoint::min(), TimePoint::max());
  const auto steady = run.log.between(cycles.front().release + kSettling, TimePoint::max());
  Row planned{.name = "distributed_clock/planned", .sample = "a cycle", .ours = Samples(steady.size())};
  Row started{.name = "distributed_clock/start", .sample = "a cycle", .ours = Samples(steady.size())};
  for (const Cycle& cycle : steady) {
    planned.ours.add(magnitude(reference->deviation(cycle.release)));
    started.ours.add(magnitude(reference->deviation(cycle.start)));
  }
  constexpr double kBoundUs = 10;  // 1 % of the period
  const double settled = settling_ms(cycles, *reference);
  const double correction = largest_correction_us(cycles);
  planned.extra = {{"settled_after_ms", settled},
                   {"largest_correction_us", correction},
                   {"drift_ppb", static_cast<double>(run.status.drift_ppb)},
                   {"pairs", static_cast<double>(run.status.pairs)},
                   {"rejected_pairs", static_cast<double>(run.status.rejected)}};
  planned.targets = {{"p99 below 0.1 us in steady state", "us", summarise(planned.ours).p99, 0.1},
                     {"settled within 2 s", "ms", settled, 2000},
                     {"no correction above its bound", "us", correction, kBoundUs, true}};
  planned.series = series_of(cycles, *reference);
  planned.note = "planned release against the reference grid, magnitude, from 2 s on";
  started.targets = {{"median below 1 us", "us", summarise(started.ours).p50, 1}};
  started.note = "first instruction against the reference grid, magnitude, from 2 s on";
  return std::vector<Row>{std::move(planned), std::move(started)};
}

}  // namespace plchost::bench
