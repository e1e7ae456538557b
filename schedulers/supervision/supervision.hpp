#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "schedulers/clock/clock.hpp"
#include "schedulers/faults/fault_trap.hpp"
#include "schedulers/faults/processor_times.hpp"
#include "schedulers/supervision/starvation.hpp"
#include "schedulers/supervision/watchdog_rules.hpp"
#include "schedulers/tasks/task.hpp"
#include "shm/base/flight_ring.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

/// The watchdogs that look from outside: a thread above all others of the instance. It sleeps until the
/// earliest moment at which a cycle could be too long, a task could have missed too many releases, or the
/// load is to be measured. It takes no lock: tasks say what they do in atomics of their own.
class Supervision {
 public:
  /// A start or an exchange of the scheduler is no reason to hit: so long nothing is counted as omitted, and
  /// no load is measured.
  static constexpr Duration kGrace = std::chrono::milliseconds(200);
  /// So much later than it wanted to wake, everything on this core stood still.
  static constexpr Duration kStandstill = Starvation::kStandstill;
  /// The guard against endless loops looks at a cycle so often within its limit: from its first look on it
  /// counts the processor time of the thread.
  static constexpr int kLooks = 8;
  /// A thread that was struck has been caught by then, or something keeps it from being caught.
  static constexpr Duration kPatience = std::chrono::milliseconds(10);

  /// `event_variables`: the trap of the thread that polls them. All outlive it. Set-up.
  Supervision(Clock& clock, const std::vector<std::unique_ptr<Task>>& tasks, FaultTrap& event_variables,
              const ProcessorTimes& times = linux_processor_times());
  Supervision(const Supervision&) = delete;
  Supervision& operator=(const Supervision&) = delete;
  ~Supervision();

  /// Hits, and wakes that come too late, are told in `ring`, whose memory outlives this. Set-up, before the
  /// thread is started.
  void tell_in(FlightRing ring) noexcept { flight_ = ring; }
  /// A wake that is less late than this says nothing of the core.
  static constexpr Duration kToldDelay = std::chrono::microseconds(200);
  [[nodiscard]] Result<void> start_thread(ThreadPriority priority);

  /// By how much it is too late to look: threads above it take the processor. Any thread.
  [[nodiscard]] Duration overdue(TimePoint now) const noexcept;
  /// Tasks are released, and must get the processor. Any thread.
  [[nodiscard]] bool watches_releases() const noexcept {
    return mode_.load(std::memory_order_relaxed) == Mode::running;
  }
  [[nodiscard]] Starvation& starvation() noexcept { return starvation_; }

  /// The tasks run from now on, or run under another scheduler. Control thread.
  void begin(const SchedulerSettings& settings, int cores);
  /// The tasks are to park: only the cycles that still run are watched. Control thread.
  void tasks_stop() noexcept { change(Mode::stopping); }
  /// All are parked. Control thread.
  void end() noexcept { change(Mode::off); }

  /// Hits what is to be hit at `now`; when to look again. The supervision's thread, or a test's.
  [[nodiscard]] TimePoint look(TimePoint now) noexcept;

 private:
  enum class Mode : std::uint8_t { off, running, stopping };
  /// One thread that runs code of the application.
  struct Watched {
    FaultTrap* trap = nullptr;
    Task* task = nullptr;                 // null: the poller of event variables
    std::atomic<Duration::rep> limit{0};  // 0: none
    std::atomic<bool> lenient{false};
    TimePoint counted_since;  // the cycle that the guard against endless loops counts, and for that:
    TimePoint looked_at;      // when it looked last
    Duration used_before{};   // the thread's processor time at the first look
    Duration waited{};        // since then, without what stood still
    TimePoint struck_since;   // the cycle that was struck
    TimePoint struck_at;
    Task::Pace pace;  // when overtaxed() was asked last
  };

  void run() noexcept;
  void change(Mode mode) noexcept;
  [[nodiscard]] TimePoint look_at(Watched& watched, TimePoint now) noexcept;
  [[nodiscard]] TimePoint look_at_cycle(Watched& watched, TimePoint since, TimePoint now) noexcept;
  [[nodiscard]] TimePoint look_for_endless_loop(Watched& watched, TimePoint since, TimePoint now) noexcept;
  [[nodiscard]] TimePoint look_at_releases(Watched& watched, TimePoint now) noexcept;
  [[nodiscard]] TimePoint look_at_load(TimePoint now) noexcept;
  void look_at_overload(TimePoint now, bool first) noexcept;
  void end_window(LoadRule& rule, TimePoint now) noexcept;
  [[nodiscard]] bool overtaxed() noexcept;
  void strike(Watched& watched, TimePoint since, TimePoint now, FaultKind kind, std::int64_t figure,
              std::int64_t limit) noexcept;
  [[nodiscard]] LoadRule::Sample sample_load() noexcept;

  Clock& clock_;
  const ProcessorTimes& times_;
  std::vector<Watched> watched_;
  std::atomic<std::uint32_t> order_{0};  // changes with the mode; the thread sleeps on it
  std::atomic<Mode> mode_{Mode::off};
  std::atomic<bool> ending_{false};
  std::atomic<bool> omitted_cycles_{false};
  std::atomic<Duration::rep> forgiven_until_{0};
  std::atomic<Duration::rep> load_interval_{0};  // 0: off
  std::atomic<int> load_maximum_{0};
  std::atomic<bool> only_overload_{false};  // no maximum was set
  std::atomic<int> cores_{1};
  std::atomic<Duration::rep> next_look_{0};  // 0: it has not looked, or is off

  Starvation starvation_;

  // The thread's own.
  FlightRing flight_;
  LoadRule load_;
  LoadRule overload_;
  bool overload_measured_ = false;  // since the window began
  TimePoint window_began_;
  std::vector<Duration> task_times_;
  Duration::rep load_epoch_ = 0;  // the forgiven_until_ after which the window began
  Thread thread_;
};

}  // namespace plchost
