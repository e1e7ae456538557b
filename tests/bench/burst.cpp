// 100 cyclic tasks that are due at one tick of CmpSchedule. From the planned release to the start of the last
// one, less what the tasks before it executed, per task: the cost of the release of one task. The floor is
// one bare thread that wakes 100 bare threads through raw futexes, same priorities, same core; a second floor
// wakes them all through one futex with one call.

#include <algorithm>
#include <array>
#include <atomic>
#include <climits>
#include <span>
#include <thread>

#include <fmt/format.h>
#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "tests/bench/many_tasks.hpp"
#include "tests/bench/parts.hpp"

namespace plchost::bench {

namespace {

constexpr std::size_t kBurstTasks = 100;
constexpr Duration kInterval = std::chrono::milliseconds(10);
constexpr Duration kBurstWork = std::chrono::microseconds(5);
constexpr ThreadPriority kAbove{.fifo = kPriority.fifo + 1};

struct Execution {
  TimePoint release;
  TimePoint start;
  TimePoint end;
};

/// The runs of each task, one writer per line, reserved beforehand.
using Log = std::vector<std::vector<Execution>>;

Log make_log(Duration slice) {
  Log log(kBurstTasks);
  for (auto& line : log) line.reserve(static_cast<std::size_t>((slice + 2 * kWarmUp) / kInterval) * 2);
  return log;
}

void add(std::vector<Execution>& line, const Execution& execution) noexcept {
  if (line.size() < line.capacity()) line.push_back(execution);
}

/// The executions of all tasks by release; ticks at which not every task ran (one was still busy) are left
/// out.
void add_overheads(const Log& log, TimePoint begin, TimePoint end, Samples& into) {
  std::vector<Execution> all;
  for (const auto& line : log) all.insert(all.end(), line.begin(), line.end());
  std::ranges::sort(all, {}, [](const Execution& one) { return std::pair(one.release, one.start); });
  for (std::size_t i = 0; i < all.size();) {
    std::size_t next = i;
    Duration before{};
    while (next < all.size() && all[next].release == all[i].release) ++next;
    for (std::size_t k = i; k + 1 < next; ++k) before += all[k].end - all[k].start;
    const TimePoint release = all[i].release;
    if (next - i == kBurstTasks && release >= begin && release < end)
      into.push((all[next - 1].start - release - before) / static_cast<Duration::rep>(kBurstTasks));
    i = next;
  }
}

Result<void> run_ours(const Plan& plan, Duration slice, Samples& into) {
  Log log = make_log(slice);
  std::vector<Execution> current(kBurstTasks);
  std::vector<TaskConfig> configs;
  for (std::size_t i = 0; i < kBurstTasks; ++i) {
    TaskConfig task;
    task.name = fmt::format("task{}", i);
    task.interval = kInterval;
    task.entry = [&one = current[i]] {
      one.start = MonotonicClock::now();
      work(kBurstWork);
      one.end = MonotonicClock::now();
    };
    task.after_cycle = [&one = current[i], &line = log[i]](const TaskCounters& counters) {
      one.release = TimePoint(Duration(counters.release_ns));
      add(line, one);
    };
    configs.push_back(std::move(task));
  }
  PLCHOST_TRY_ASSIGN(const auto tasks, ManyTasks::start(plan, "CmpSchedule", std::move(configs)));
  const OnCore out_of_the_way(plan.poster_core);
  std::this_thread::sleep_for(kWarmUp);
  const TimePoint begin = MonotonicClock::now();
  std::this_thread::sleep_for(slice);
  const TimePoint end = MonotonicClock::now();
  if (auto stopped = tasks->stop(); !stopped) return stopped;
  add_overheads(log, begin, end, into);
  return {};
}

void wait_private(const std::atomic<std::uint32_t>& word, std::uint32_t seen) noexcept {
  ::syscall(SYS_futex, &word, FUTEX_WAIT_PRIVATE, seen, nullptr, nullptr, 0);
}

void wake_private(const std::atomic<std::uint32_t>& word) noexcept {
  ::syscall(SYS_futex, &word, FUTEX_WAKE_PRIVATE, INT_MAX, nullptr, nullptr, 0);
}

/// A futex per thread, or one for all, and the thread that opens them.
struct BareBurst {
  bool one_word = false;
  std::atomic<bool> stopping{false};
  TimePoint release{};
  std::array<std::atomic<std::uint32_t>, kBurstTasks> words{};

  void run_task(std::size_t index, std::vector<Execution>& line) noexcept {
    auto& word = words[one_word ? 0 : index];
    std::uint32_t seen = 0;
    for (;;) {
      std::uint32_t now = 0;
      while ((now = word.load(std::memory_order_acquire)) == seen) wait_private(word, seen);
      seen = now;  // from here on no release is slept through
      if (stopping.load()) return;
      const TimePoint start = MonotonicClock::now();
      work(kBurstWork);
      add(line, {release, start, MonotonicClock::now()});
    }
  }
  void open_all() noexcept {
    for (auto& word : std::span(words).first(one_word ? 1 : kBurstTasks)) {
      word.fetch_add(1, std::memory_order_release);
      wake_private(word);
    }
  }
  /// Before the tick has ended it may open once more; a thread that has seen the end does not care.
  void end() noexcept {
    stopping.store(true);
    open_all();
  }
  void run_tick() noexcept {
    TimePoint next = MonotonicClock::now() + kInterval;
    while (!stopping.load()) {
      const timespec until = to_timespec(next);
      ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
      if (stopping.load()) return;
      release = next;
      open_all();
      const TimePoint now = MonotonicClock::now();
      do next += kInterval;
      while (next <= now);
    }
  }
};

Result<void> start_bare(const Plan& plan, BareBurst& bare, Log& log, std::vector<Thread>& threads) {
  const OnCore threads_inherit_it(plan.task_core);
  for (std::size_t i = 0; i <= kBurstTasks; ++i) {
    auto thread = i < kBurstTasks ? Thread::start(
                                        "bare", kPriority, [&, i] { bare.run_task(i, log[i]); })
                                  : Thread::start("bare-tick", kAbove, [&] { bare.run_tick(); });
    if (!thread) return std::unexpected(std::move(thread.error()));
    threads.push_back(std::move(*thread));
  }
  return {};
}

Result<void> run_floor(const Plan& plan, bool one_word, Duration slice, Samples& into) {
  Log log = make_log(slice);
  BareBurst bare{.one_word = one_word};
  std::vector<Thread> threads;
  if (auto started = start_bare(plan, bare, log, threads); !started) {
    bare.end();
    threads.clear();
    return started;
  }
  const OnCore out_of_the_way(plan.poster_core);
  std::this_thread::sleep_for(kWarmUp);
  const TimePoint begin = MonotonicClock::now();
  std::this_thread::sleep_for(slice);
  const TimePoint end = MonotonicClock::now();
  bare.end();
  threads.clear();
  add_overheads(log, begin, end, into);
  return {};
}

}  // namespace

Result<std::vector<Row>> measure_burst(const Plan& plan) {
  Row row{.name = "burst/CmpSchedule/100tasks", .sample = "a tick, per task"};
  Samples one_word;
  auto done = alternate(plan, {[&](Duration slice) { return run_floor(plan, false, slice, row.floor); },
                               [&](Duration slice) { return run_floor(plan, true, slice, one_word); },
                               [&](Duration slice) { return run_ours(plan, slice, row.ours); }});
  if (!done) return std::unexpected(std::move(done.error()));
  row.extra = {{"floor_one_futex_p50_us", summarise(one_word).p50},
               {"floor_one_futex_p99_us", summarise(one_word).p99}};
  row.targets = {{"median below 3 us for each task", "us", summarise(row.ours).p50, 3},
                 {"median at most 1.5 x a bare wake of each through a futex", "us", summarise(row.ours).p50,
                  1.5 * summarise(row.floor).p50, true}};
  row.note = "per task: (start of the last - planned release - executions before it) / 100";
  return std::vector{row};
}

}  // namespace plchost::bench
