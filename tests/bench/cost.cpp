// The runtime's cost per cycle: the processor time of an empty task with its statistics under
// CmpScheduleTimer. Beside it the same loop without them: a thread that reads two timerfds in turn, as the
// scheduler's does, and calls an empty function. One sample per slice. And the same without the wait, a
// million cycles back to back. And what one entry of the flight recorder costs of that.

#include <array>
#include <vector>

#include <sys/resource.h>

#include "tests/bench/cyclic_loop.hpp"
#include "tests/bench/parts.hpp"

namespace plchost::bench {

namespace {

constexpr Duration kCostSlice = std::chrono::seconds(1);

/// Page faults so far in this process.
double page_faults() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_minflt + usage.ru_majflt);
}

Result<Row> measure_with_wait(const Plan& plan, Duration period, const char* name) {
  ScheduledLoop scheduled("CmpScheduleTimer", period);
  BareLoop bare(Wait::two_timers, period, [] {});
  CyclicFigures ours;
  CyclicFigures floor;
  auto done = alternate(
      plan, {slices_of(plan, bare, period, floor), slices_of(plan, scheduled, period, ours)}, kCostSlice);
  if (!done) return std::unexpected(std::move(done.error()));
  const double more = summarise(ours.cpu_per_cycle).p50 - summarise(floor.cpu_per_cycle).p50;
  const auto per_cycle = [](std::uint64_t count, const CyclicFigures& figures) {
    return ratio(static_cast<double>(count), static_cast<double>(figures.cycles));
  };
  return Row{
      .name = name,
      .sample = "a slice's mean of a cycle",
      .ours = ours.cpu_per_cycle,
      .floor = floor.cpu_per_cycle,
      .extra = {{"more_cpu_ns_per_cycle", 1e3 * more},
                {"voluntary_switches_per_cycle", per_cycle(ours.usage.voluntary, ours)},
                {"floor_voluntary_switches_per_cycle", per_cycle(floor.usage.voluntary, floor)},
                {"cycles", static_cast<double>(ours.cycles)}},
      .targets = {{.text = "below 1 us of CPU beside the same loop without them",
                   .unit = "us",
                   .measured = more,
                   .bound = 1,
                   .only_steady = true}},
      .note = "CPU time per cycle, a sample is a slice; the benchmark's own stamps and log are in both"};
}

/// CPU time per call of many calls in a row, on this thread.
template <class Call>
Duration time_of(Call call) {
  constexpr int kCalls = 20000;
  const auto cpu = [] {
    timespec time{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
  };
  const Duration before = cpu();
  for (int i = 0; i < kCalls; ++i) call();
  return (cpu() - before) / kCalls;
}

/// A ring as large as that of each of 29 tasks.
struct RingMemory {
  FlightRing::Word written{0};
  std::array<FlightRing::Word, 4096 * FlightRing::kWordsOfEntry> words{};
};

/// One entry, beside the plain store of its 16 bytes into the same memory.
Result<Row> measure_entry(const Plan& plan) {
  constexpr int kRounds = 50;
  Row row{.name = "cost/recorder/entry", .sample = "the mean of 20,000 entries"};
  row.ours = Samples(kRounds);
  row.floor = Samples(kRounds);
  auto body = [&] {
    const auto memory = std::make_unique<RingMemory>();
    FlightRing ring(memory->written, memory->words);
    struct Entry {
      std::int64_t time;
      std::int64_t figure;
    };
    std::vector<Entry> plain(memory->words.size() / FlightRing::kWordsOfEntry);
    std::int64_t number = 0;
    for (int round = 0; round < kRounds; ++round) {
      row.floor.add(time_of([&] {
        Entry* const place = &plain[static_cast<std::size_t>(++number) & (plain.size() - 1)];
        *place = {.time = number, .figure = number};
        asm volatile("" : : "r"(place) : "memory");
      }));
      row.ours.add(time_of([&] {
        ++number;
        ring.put(TimePoint(Duration(number)), FlightKind::start, number);
      }));
    }
  };
  const OnCore thread_inherits_it(plan.task_core);
  PLCHOST_TRY_ASSIGN(auto thread, Thread::start("cost", kPriority, body));
  thread.join();
  constexpr double kNsPerUs = 1000;
  row.targets = {{"below 50 ns of CPU", "ns", kNsPerUs * summarise(row.ours).p50, 50}};
  row.note = "a cycle writes two: the times are those that it has read for its statistics";
  return row;
}

/// Without the wait: Task::run_cycle of an empty task, beside calling the empty function.
Result<Row> measure_back_to_back(const Plan& plan) {
  constexpr int kRounds = 50;
  Row row{.name = "cost/run_cycle/no-wait", .sample = "the mean of 20,000 cycles"};
  row.ours = Samples(kRounds);
  row.floor = Samples(kRounds);
  double faults = 0;
  auto body = [&] {
    LinuxClock clock;
    const auto statistics = std::make_unique<TaskStatistics>();
    TaskConfig config;
    config.name = "empty";
    config.interval = std::chrono::milliseconds(1);
    config.entry = [] {};
    const std::function<void()> entry = config.entry;
    Task task(clock, config, *statistics, nullptr);
    const auto ring = std::make_unique<RingMemory>();
    task.tell_in(FlightRing(ring->written, ring->words));
    task.begin(clock.now());
    const double before = page_faults();
    for (int round = 0; round < kRounds; ++round) {
      row.floor.add(time_of([&] { entry(); }));
      row.ours.add(time_of([&] { task.run_cycle({.release = clock.now()}); }));
    }
    faults = page_faults() - before;
  };
  const OnCore thread_inherits_it(plan.task_core);
  PLCHOST_TRY_ASSIGN(auto thread, Thread::start("cost", kPriority, body));
  thread.join();
  row.extra = {{"page_faults_in_a_million_cycles", faults}};
  row.targets = {{"below 1 us of CPU", "us", summarise(row.ours).p50 - summarise(row.floor).p50, 1}};
  row.note = "a sample is 20,000 cycles; one reading of the clock for the release is in ours";
  return row;
}

}  // namespace

Result<std::vector<Row>> measure_cost(const Plan& plan) {
  std::vector<Row> rows;
  for (auto row : {measure_with_wait(plan, std::chrono::milliseconds(1), "cost/cycle/1ms"),
                   measure_with_wait(plan, std::chrono::microseconds(100), "cost/cycle/100us"),
                   measure_back_to_back(plan), measure_entry(plan)}) {
    if (!row) return std::unexpected(std::move(row.error()));
    rows.push_back(std::move(*row));
  }
  return rows;
}

}  // namespace plchost::bench
