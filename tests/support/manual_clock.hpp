#pragma once

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <vector>

#include "schedulers/clock/clock.hpp"

namespace plchost {

/// Time that a test moves by hand. Threads that sleep by this clock are woken in the order of their
/// deadlines, and time goes on only when all of them sleep again: nothing depends on real time.
class ManualClock final : public Clock {
 public:
  explicit ManualClock(TimePoint begin = TimePoint(std::chrono::seconds(1000))) { set_now(begin); }

  // --- for the test ---

  /// Waits until every thread sleeps.
  void settle() {
    std::unique_lock lock(mutex_);
    wait_until_all_sleep(lock);
  }

  /// Moves from deadline to deadline up to `end`; tasks that fall due at `end` itself have run when it
  /// returns.
  void run_until(TimePoint end) {
    std::unique_lock lock(mutex_);
    for (;;) {
      wait_until_all_sleep(lock);
      const TimePoint next = next_deadline();
      if (next > end) break;
      set_now(std::max(now(), next));
      rouse([&](const Sleeper& sleeper) { return wakes_at(sleeper) <= now(); });
    }
    set_now(std::max(now(), end));
  }
  void run_for(Duration duration) { run_until(now() + duration); }

  /// From now on, sleepers wake this much after their deadline, as they do on a real system.
  void set_wake_latency(Duration latency) {
    const std::lock_guard lock(mutex_);
    wake_latency_ = latency;
  }

  /// As if the system had no timers left.
  void refuse_timers(bool refuse) { refuse_timers_ = refuse; }

  /// For the code of a task: the time that its cycle takes.
  void spend(Duration duration) noexcept { spin_until(now() + duration); }
  /// Counts as processor time of the calling thread.
  static void charge(Duration duration) noexcept { thread_time_ += duration; }
  /// For the code of a task: the time for which others take the processor from it.
  void lose_processor(Duration duration) noexcept { stand_until(now() + duration); }

  // --- Clock ---

  [[nodiscard]] TimePoint now() const noexcept override { return TimePoint(Duration(now_.load())); }

  void wait(const std::atomic<std::uint32_t>& word, std::uint32_t expected,
            TimePoint deadline) noexcept override {
    std::unique_lock lock(mutex_);
    if (word.load() != expected || deadline <= now()) return;
    sleep(lock, {.word = &word, .deadline = deadline});
  }

  void wake(const std::atomic<std::uint32_t>& word) noexcept override {
    const std::lock_guard lock(mutex_);
    rouse([&](const Sleeper& sleeper) { return sleeper.word == &word; });
  }

  void spin_until(TimePoint deadline) noexcept override {
    charge(std::max(deadline - now(), Duration::zero()));
    stand_until(deadline);
  }
  [[nodiscard]] Duration thread_time() const noexcept override { return thread_time_; }

  /// The event's word is not this clock's: a thread that sleeps on it counts as asleep until it runs again,
  /// so a test that posts waits for what it expects.
  void wait(CountedEvent& event, CountedEvent::Snapshot seen) noexcept override {
    count_outside(1);
    event.wait(seen);
    count_outside(-1);
  }

  [[nodiscard]] Result<std::unique_ptr<PeriodicTimer>> make_periodic_timer() override {
    if (refuse_timers_) return failure(ErrorCode::full, "no timers left");
    return std::make_unique<Timer>(*this);
  }

  void thread_begins() noexcept override { count_threads(1); }
  void thread_ends() noexcept override { count_threads(-1); }

 private:
  struct Sleeper {
    const std::atomic<std::uint32_t>* word = nullptr;
    TimePoint deadline = kNoDeadline;
    bool exact = false;  // spins: no wake-up latency
    bool roused = false;
  };

  class Timer final : public PeriodicTimer {
   public:
    explicit Timer(ManualClock& clock) noexcept : clock_(clock) {}

    void start(TimePoint first, Duration period) noexcept override {
      next_ = first;
      period_ = period;
    }

    std::uint64_t wait() noexcept override {
      while (interrupted_.load() == 0 && clock_.now() < next_) clock_.wait(interrupted_, 0, next_);
      if (interrupted_.exchange(0) != 0) return 0;
      const auto count = (clock_.now() - next_) / period_ + 1;
      next_ += count * period_;
      return static_cast<std::uint64_t>(count);
    }

    void interrupt() noexcept override {
      interrupted_.store(1);
      clock_.wake(interrupted_);
    }

   private:
    ManualClock& clock_;
    TimePoint next_ = kNoDeadline;
    Duration period_{1};
    std::atomic<std::uint32_t> interrupted_{0};
  };

  void stand_until(TimePoint deadline) {
    std::unique_lock lock(mutex_);
    while (now() < deadline) sleep(lock, {.deadline = deadline, .exact = true});
  }

  void set_now(TimePoint now) { now_.store(now.time_since_epoch().count()); }

  [[nodiscard]] TimePoint wakes_at(const Sleeper& sleeper) const {
    if (sleeper.deadline == kNoDeadline || sleeper.exact) return sleeper.deadline;
    return sleeper.deadline + wake_latency_;
  }

  [[nodiscard]] TimePoint next_deadline() const {
    TimePoint next = kNoDeadline;
    for (const Sleeper* sleeper : sleepers_) next = std::min(next, wakes_at(*sleeper));
    return next;
  }

  void sleep(std::unique_lock<std::mutex>& lock, Sleeper sleeper) {
    sleepers_.push_back(&sleeper);
    all_sleep_.notify_all();
    roused_.wait(lock, [&] { return sleeper.roused; });
  }

  // A roused thread counts as awake at once, not only when its thread gets the processor.
  template <class Predicate>
  void rouse(Predicate predicate) {
    std::erase_if(sleepers_, [&](Sleeper* sleeper) {
      if (predicate(*sleeper)) sleeper->roused = true;
      return sleeper->roused;
    });
    roused_.notify_all();
  }

  void count_threads(int change) {
    const std::lock_guard lock(mutex_);
    threads_ += change;
    all_sleep_.notify_all();
  }
  void count_outside(int change) {
    const std::lock_guard lock(mutex_);
    outside_ += change;
    all_sleep_.notify_all();
  }

  void wait_until_all_sleep(std::unique_lock<std::mutex>& lock) {
    constexpr auto kPatience = std::chrono::seconds(50);
    const auto done = [&] { return static_cast<int>(sleepers_.size()) + outside_ >= threads_; };
    if (all_sleep_.wait_for(lock, kPatience, done)) return;
    std::fputs("ManualClock: a thread never went back to sleep\n", stderr);
    std::abort();
  }

  static inline thread_local Duration thread_time_{};  // burnt by this thread

  mutable std::mutex mutex_;
  std::condition_variable all_sleep_;
  std::condition_variable roused_;
  std::atomic<Duration::rep> now_{0};
  Duration wake_latency_{};
  std::atomic<bool> refuse_timers_{false};
  int threads_ = 0;
  int outside_ = 0;
  std::vector<Sleeper*> sleepers_;
};

}  // namespace plchost
