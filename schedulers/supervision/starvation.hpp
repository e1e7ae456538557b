#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "schedulers/faults/fault_trap.hpp"
#include "schedulers/faults/processor_guard.hpp"
#include "schedulers/faults/processor_times.hpp"
#include "schedulers/tasks/task.hpp"

namespace plchost {

/// Finds the threads of this process that take the processor by a real-time priority: by what each uses
/// between two moments. One thread at a time; real-time.
class TakerSearch {
 public:
  /// So far apart the two moments are.
  static constexpr Duration kLength = std::chrono::milliseconds(50);
  /// More threads with a real-time priority than that are not looked at.
  static constexpr std::size_t kMost = 256;

  explicit TakerSearch(const ProcessorTimes& times) noexcept : times_(times) {}

  void begin(TimePoint now) noexcept;
  [[nodiscard]] bool begun() const noexcept { return begun_; }
  /// When it is to be ended at the earliest.
  [[nodiscard]] TimePoint ends() const noexcept { return began_ + kLength; }
  void forget() noexcept { begun_ = false; }
  /// Takes their real-time priority from all threads that have used more than a tenth of the time since it
  /// was begun, but for `spared`. Which of them has used the most; empty: there is none.
  [[nodiscard]] ThreadText end(TimePoint now, std::span<const pid_t> spared) noexcept;

 private:
  struct Thread {
    pid_t id = 0;
    Duration used{};
  };

  const ProcessorTimes& times_;
  bool begun_ = false;
  TimePoint began_;
  std::array<Thread, kMost> threads_{};
  std::size_t count_ = 0;
};

/// Real-time tasks that are ready to run and get no processor, because a thread that the application has made
/// takes it: no other watchdog knows such a thread. It loses its real-time priority, so that everything else
/// runs again, and the task has a fault. If nothing of this process takes the processor, that is only told.
class Starvation {
 public:
  /// A task is ready to run for so long in vain. It is half of the time of the guard against endless loops,
  /// which sees a thread that runs tasks, but no less than this.
  static constexpr Duration kLeast = std::chrono::milliseconds(200);
  /// It looks so often within its limit.
  static constexpr int kLooks = 8;
  /// So much later than it wanted to look, everything on this core stood still.
  static constexpr Duration kStandstill = std::chrono::milliseconds(5);

  /// All outlive it. Set-up.
  Starvation(const std::vector<std::unique_ptr<Task>>& tasks, const FaultTrap& event_variables,
             const ProcessorTimes& times);

  /// For how long a task, or the runtime, may be kept from the processor. `guard`: the time of the guard
  /// against endless loops; 0: for ever.
  [[nodiscard]] static constexpr Duration limit_for(Duration guard) noexcept {
    constexpr int kPart = 2;
    return guard == Duration::zero() ? guard : std::max(guard / kPart, kLeast);
  }
  /// `guard`: as above. Control thread.
  void begin(Duration guard) noexcept;
  /// 0: nothing is looked for. Any thread.
  [[nodiscard]] Duration limit() const noexcept { return Duration(limit_.load(std::memory_order_relaxed)); }
  /// `running`: the tasks are released. When to look again. The supervision's thread, or a test's.
  [[nodiscard]] TimePoint look(TimePoint now, bool running) noexcept;
  /// Is to look again also when the tasks have stopped. The supervision's thread.
  [[nodiscard]] bool searching() const noexcept { return search_.begun(); }
  /// The number of a task that got no processor, though this process did not take it: once. Any thread.
  [[nodiscard]] std::optional<std::size_t> take_starved_by_others() noexcept;

 private:
  /// The cycle for which a task is ready and has got no processor yet.
  struct Hunger {
    std::optional<Task::Demand> demand;
    TimePoint looked_at;    // last
    bool measured = false;  // the following members hold
    Duration lasted{};      // without what stood still
    Duration used{};        // when that began, by the task's thread,
    Duration by_process{};
    Duration by_tasks{};  // and by all that run tasks
  };

  void look_at(std::size_t index, TimePoint now) noexcept;
  enum class Takers : std::uint8_t { threads_of_tasks, other_threads, other_programs };
  [[nodiscard]] Takers takers_from(std::size_t index) noexcept;
  void end_search(TimePoint now) noexcept;
  void take_reported(TimePoint now) noexcept;
  void raise(Task& task, Duration lasted, const ThreadText& who) noexcept;
  [[nodiscard]] Task* hungriest(TimePoint now) const noexcept;
  [[nodiscard]] Duration used_by_tasks() noexcept;
  [[nodiscard]] Duration used_by(const FaultTrap& trap) const noexcept;

  const std::vector<std::unique_ptr<Task>>& tasks_;
  const FaultTrap& event_variables_;
  const ProcessorTimes& times_;
  std::atomic<Duration::rep> limit_{0};
  std::atomic<std::size_t> by_others_{0};  // number of the task + 1

  // The supervision's thread's own.
  std::vector<Hunger> hunger_;
  std::vector<pid_t> own_threads_;  // that run tasks
  TimePoint next_;
  TakerSearch search_;
  std::optional<std::size_t> searched_for_;  // a task that waits for what the search finds
};

}  // namespace plchost
