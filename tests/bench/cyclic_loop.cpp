#include "tests/bench/cyclic_loop.hpp"

#include <array>
#include <thread>

#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

#include "shm/base/unique_fd.hpp"

namespace plchost::bench {

namespace {

constexpr auto kLoopStopLimit = std::chrono::seconds(10);

void sleep_until(TimePoint release) noexcept {
  const timespec until = to_timespec(release);
  ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
}

void spin_until(TimePoint release) noexcept {
  while (MonotonicClock::now() < release) __builtin_ia32_pause();
}

UniqueFd make_timer(TimePoint first, Duration period) {
  UniqueFd timer(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC));
  const itimerspec value{.it_interval = to_timespec(period), .it_value = to_timespec(first)};
  ::timerfd_settime(timer.get(), TFD_TIMER_ABSTIME, &value, nullptr);
  return timer;
}

std::size_t capacity_for(const Duration slice, Duration period) {
  return static_cast<std::size_t>((slice + 2 * kWarmUp) / period) * 2;
}

}  // namespace

BareLoop::BareLoop(Wait wait, Duration period, std::function<void()> entry)
    : wait_(wait), period_(period), entry_(std::move(entry)) {}

BareLoop::~BareLoop() {
  (void)stop();
}

Result<void> BareLoop::start(CycleLog& log) {
  stopping_.store(false);
  PLCHOST_TRY_ASSIGN(thread_, Thread::start("floor", kPriority, [this, &log] { run(log); }));
  return {};
}

Result<void> BareLoop::stop() {
  stopping_.store(true);
  thread_.join();
  return {};
}

void BareLoop::run(CycleLog& log) noexcept {
  TimePoint release = MonotonicClock::now() + TaskSet::kStartLead;
  if (first_ != TimePoint{}) release = first_ + (release - first_ + period_) / period_ * period_;
  // Of two, each goes off every second time.
  const bool two = wait_ == Wait::two_timers;
  const std::array timers{
      two || wait_ == Wait::timer ? make_timer(release, two ? 2 * period_ : period_) : UniqueFd(),
      two ? make_timer(release + period_, 2 * period_) : UniqueFd()};
  for (const TimePoint first = release;;) {
    if (stopping_.load(std::memory_order_relaxed)) break;
    const std::size_t next = two ? static_cast<std::size_t>((release - first) / period_ % 2) : 0;
    std::uint64_t count = 0;
    if (wait_ == Wait::sleep) sleep_until(release);
    if (wait_ == Wait::spin) spin_until(release);
    TimePoint start{};
    do {
      if (timers[next] && ::read(timers[next].get(), &count, sizeof count) < 0) return;
      start = MonotonicClock::now();
    } while (two && start < release);  // it went off for a release that was skipped
    log.add({release, start});
    if (entry_) entry_();
    const TimePoint end = entry_ ? MonotonicClock::now() : start;
    // Like ours: a release that passed while it was busy is skipped, never replayed.
    do release += period_;
    while (release <= end);
  }
}

ScheduledLoop::ScheduledLoop(std::string_view scheduler, Duration period, SchedulerSettings settings)
    : scheduler_(scheduler), period_(period), settings_(settings) {}

Result<void> ScheduledLoop::start(CycleLog& log) {
  statistics_ = std::make_unique<TaskStatistics>();
  spun_ns_.store(0);
  release_ns_.store(0);
  TaskConfig task;
  task.name = "measured";
  task.interval = period_;
  task.entry = [this] { began_ = MonotonicClock::now(); };
  task.after_cycle = [this, &log](const TaskCounters& counters) {
    log.add({TimePoint(Duration(counters.release_ns)), began_});
    spun_ns_.store(counters.spin_sum_ns, std::memory_order_relaxed);
    release_ns_.store(counters.release_ns, std::memory_order_relaxed);
  };
  TaskEnvironment environment;
  environment.statistics = [this](std::size_t) -> TaskStatistics& { return *statistics_; };
  PLCHOST_TRY_ASSIGN(tasks_, TaskSet::create(clock_, PriorityBand::normal, {task}, environment));
  return tasks_->start(scheduler_, settings_);
}

Result<void> ScheduledLoop::stop() {
  auto stopped = tasks_->stop(kLoopStopLimit);
  tasks_.reset();
  return stopped;
}

Subject slices_of(const Plan& plan, CyclicLoop& loop, Duration period, CyclicFigures& into) {
  return [&plan, &loop, period, &into](Duration slice) -> Result<void> {
    CycleLog log(capacity_for(slice, period));
    {
      const OnCore threads_inherit_it(plan.task_core);
      if (auto started = loop.start(log); !started) return started;
    }
    const OnCore out_of_the_way(plan.poster_core);
    std::this_thread::sleep_for(kWarmUp);
    const ThreadUsage usage_before = usage_of_other_threads();
    const Duration spun_before = loop.spun();
    const TimePoint begin = MonotonicClock::now();
    std::this_thread::sleep_for(slice);
    const ThreadUsage usage = usage_of_other_threads() - usage_before;
    const Duration spun = loop.spun() - spun_before;
    const TimePoint end = MonotonicClock::now();
    if (auto stopped = loop.stop(); !stopped) return stopped;
    const auto cycles = log.between(begin, end);
    add_latencies(cycles, into.latencies);
    into.cycles += cycles.size();
    into.lost += lost_cycles(cycles, period);
    into.usage += usage;
    into.measured += end - begin;
    into.spun += spun;
    if (!cycles.empty()) into.cpu_per_cycle.push(usage.cpu / static_cast<Duration::rep>(cycles.size()));
    return {};
  };
}

}  // namespace plchost::bench
