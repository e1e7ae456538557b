#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "schedulers/task_set.hpp"
#include "tests/bench/bench.hpp"
#include "tests/bench/cycle_log.hpp"
#include "tests/bench/thread_usage.hpp"

namespace plchost::bench {

/// Something that runs cycles on the task core and notes them.
class CyclicLoop {
 public:
  virtual ~CyclicLoop() = default;
  /// Runs until stop(), noting the cycles in `log`.
  [[nodiscard]] virtual Result<void> start(CycleLog& log) = 0;
  [[nodiscard]] virtual Result<void> stop() = 0;
  /// Time spun ahead of releases since start().
  [[nodiscard]] virtual Duration spun() const noexcept { return {}; }
};

/// How a bare loop waits for its next release.
enum class Wait : std::uint8_t {
  sleep,      ///< clock_nanosleep(TIMER_ABSTIME): the floor F
  spin,       ///< looks at the clock
  timer,      ///< read() of a periodic timerfd
  two_timers  ///< read() of two timerfds that go off in turn, as the timer of the schedulers does
};

/// A bare SCHED_FIFO thread with nothing of plchost: the floor. Like ours it skips what passed.
class BareLoop final : public CyclicLoop {
 public:
  /// `entry` runs in each cycle and may be empty.
  BareLoop(Wait wait, Duration period, std::function<void()> entry = {});
  ~BareLoop() override;
  [[nodiscard]] Result<void> start(CycleLog& log) override;
  [[nodiscard]] Result<void> stop() override;
  /// The next start() releases at `first` + n periods.
  void align(TimePoint first) noexcept { first_ = first; }

 private:
  void run(CycleLog& log) noexcept;

  Wait wait_;
  Duration period_;
  std::function<void()> entry_;
  TimePoint first_{};
  std::atomic<bool> stopping_{false};
  Thread thread_;
};

/// A bare thread one priority higher that sleeps to each release and then wakes the task's thread through a
/// futex: the floor of any scheduler with a tick.
class BareHop final : public CyclicLoop {
 public:
  explicit BareHop(Duration period) : period_(period) {}
  ~BareHop() override;
  [[nodiscard]] Result<void> start(CycleLog& log) override;
  [[nodiscard]] Result<void> stop() override;

 private:
  void tick() noexcept;
  void run(CycleLog& log) noexcept;
  void open() noexcept;

  Duration period_;
  std::atomic<std::uint32_t> word_{0};
  std::atomic<std::int64_t> release_ns_{0};
  std::atomic<bool> stopping_{false};
  Thread tick_;
  Thread thread_;
};

/// One cyclic task of the highest priority under a scheduler.
class ScheduledLoop final : public CyclicLoop {
 public:
  ScheduledLoop(std::string_view scheduler, Duration period, SchedulerSettings settings = {});
  [[nodiscard]] Result<void> start(CycleLog& log) override;
  [[nodiscard]] Result<void> stop() override;
  [[nodiscard]] Duration spun() const noexcept override { return Duration(spun_ns_.load()); }
  /// Planned release of the last cycle; the epoch before the first one.
  [[nodiscard]] TimePoint last_release() const noexcept { return TimePoint(Duration(release_ns_.load())); }

 private:
  std::string scheduler_;
  Duration period_;
  SchedulerSettings settings_;
  LinuxClock clock_;
  std::unique_ptr<TaskStatistics> statistics_;
  TimePoint began_{};
  std::atomic<std::int64_t> spun_ns_{0};
  std::atomic<std::int64_t> release_ns_{0};
  std::unique_ptr<TaskSet> tasks_;
};

/// The results of all slices of one loop.
struct CyclicFigures {
  Samples latencies;
  std::uint64_t cycles = 0;
  std::uint64_t lost = 0;
  ThreadUsage usage;
  Duration measured{};
  Duration spun{};
  Samples cpu_per_cycle;  ///< one per slice

  [[nodiscard]] double cpu_us() const noexcept { return ratio(to_us(usage.cpu), per_cycle()); }
  [[nodiscard]] double switches() const noexcept {
    return ratio(static_cast<double>(usage.switches()), per_cycle());
  }
  [[nodiscard]] double lost_per_million() const noexcept {
    return 1e6 * ratio(static_cast<double>(lost), static_cast<double>(cycles + lost));
  }
  [[nodiscard]] double spin_share() const noexcept { return ratio(to_us(spun), to_us(measured)); }

 private:
  [[nodiscard]] double per_cycle() const noexcept { return static_cast<double>(cycles); }
};

/// A subject for alternate(): each slice starts the loop anew on the task core; its warm-up does not count.
/// All three outlive it.
[[nodiscard]] Subject slices_of(const Plan& plan, CyclicLoop& loop, Duration period, CyclicFigures& into);

}  // namespace plchost::bench
