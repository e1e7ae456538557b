#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "schedulers/distributed_clock/clock_model.hpp"
#include "schedulers/distributed_clock/clock_regulator.hpp"
#include "schedulers/distributed_clock/phase.hpp"
#include "schedulers/settings/scheduler_settings.hpp"
#include "shm/base/seqlock.hpp"

namespace plchost {

enum class ClockState : std::uint32_t {
  off = 0,           ///< no reference is named, and the application has reported none
  free_running = 1,  ///< there is no usable reference (yet)
  acquiring = 2,     ///< pairs come in; the grid is on its way, not in sync
  locked = 3,        ///< pairs come in, in sync
  hold_over = 4,     ///< no pair taken for the timeout: the grid goes on with the last drift
  measuring = 5,     ///< the clock is measured, but this scheduler cannot move its releases
};

/// Why no pair was taken for the timeout.
enum class ClockSilence : std::uint32_t {
  none = 0,      ///< pairs are taken, or the timeout is not over
  nothing,       ///< nobody has written one
  stands_still,  ///< the reference shows the same time again and again
  no_clock,      ///< its times lie on no line that a clock can have
  other_time,    ///< the local stamps are not of now
  invalid,       ///< the writer says that its clock does not hold
  corrupt,       ///< the record was written by no writer of ours
};

/// The state of the clock, seen from one task. Durations in nanoseconds.
struct ClockStatus {
  ClockState state = ClockState::off;
  ClockSilence silence = ClockSilence::none;
  bool in_sync = false;  ///< the task's releases are within the window, or were when the reference stopped
  std::int64_t offset_ns =
      0;  ///< of the task's planned releases from the reference grid, as measured; > 0: late
  std::int64_t drift_ppb = 0;              ///< the reference is this much faster than CLOCK_MONOTONIC
  std::uint64_t pairs = 0;                 ///< taken
  std::uint64_t rejected = 0;              ///< outliers, and those out of order or range, too old or corrupt
  std::uint64_t invalid = 0;               ///< the writer said that its clock does not hold
  std::uint64_t steps = 0;                 ///< of the reference, that were followed
  std::int64_t correction_ns = 0;          ///< of the task's last planned release
  std::int64_t correction_max_ns = 0;      ///< the largest magnitude so far
  std::uint64_t corrections_at_bound = 0;  ///< how often it was cut to its bound
};

class ClockFollower;

/// The reference clock of one set of tasks. There is one regulator; whichever task plans its next release
/// first feeds it with the newest pair, without a lock. A task that finds another one at it goes on with the
/// line that it has. Each cyclic task follows the line by itself (ClockFollower).
class DistributedClock {
 public:
  DistributedClock();
  ~DistributedClock();
  DistributedClock(const DistributedClock&) = delete;
  DistributedClock& operator=(const DistributedClock&) = delete;

  /// One for each cyclic task, before anything runs; the first one is the one that status() is asked for
  /// most: see leading(). Set-up.
  [[nodiscard]] ClockFollower& add_follower(int iec_priority);
  /// While no task runs: begins to learn anew. Set-up.
  void configure(const DistributedClockSettings& settings);
  /// Whether releases may be moved: a capability of the scheduler. Set-up.
  void set_steering(bool steering) noexcept { steering_.store(steering, std::memory_order_relaxed); }
  /// Where pairs come from from now on; null: from report(). false: a task that is not given the processor is
  /// still at the old one; try again later. When it has returned true the old one is free to go. Control
  /// thread.
  [[nodiscard]] bool use_source(ReferenceSource* source) noexcept;

  /// By the application, instead of a source. false: there is a source. A pair that is reported while another
  /// task reports one is dropped. Any context.
  [[nodiscard]] bool report(const ReferencePair& pair) noexcept;

  /// Any context.
  [[nodiscard]] ClockStatus status(const ClockFollower& follower) const noexcept;
  /// Of the cyclic task of the highest priority; null: there is none.
  [[nodiscard]] const ClockFollower* leading() const noexcept { return leading_; }

 private:
  friend class ClockFollower;

  /// The regulator's knowledge, for all tasks and other readers.
  struct Shared {
    ClockModel model;
    double bias_ns = 0;
    TimePoint last_pair;
    TimePoint began;                                // the first look since configure()
    ClockSilence left_out = ClockSilence::nothing;  // the newest one that was not taken
    TimePoint left_out_at;
    std::uint32_t usable = 0;
    std::uint32_t any = 0;  // a pair was taken since configure()
    std::uint64_t pairs = 0;
    std::uint64_t rejected = 0;
    std::uint64_t invalid = 0;
    std::uint64_t steps = 0;
  };
  struct Report {
    ReferencePair pair;
    std::uint64_t updates = 0;
  };

  void poll(TimePoint now) noexcept;
  [[nodiscard]] bool consume(const ReferenceSource::Reading& reading, TimePoint now) noexcept;
  void feed(const ReferencePair& pair, TimePoint now) noexcept;
  void leave_out(ClockSilence why, TimePoint now) noexcept;
  [[nodiscard]] ReferenceSource::Reading reported() const noexcept;
  [[nodiscard]] bool active() const noexcept { return active_.load(std::memory_order_acquire); }

  DistributedClockSettings settings_;
  std::vector<std::unique_ptr<ClockFollower>> followers_;
  const ClockFollower* leading_ = nullptr;
  std::atomic<bool> active_{false};
  std::atomic<bool> steering_{false};

  std::atomic<bool> polling_{false};  // the thread that sets it owns the next five
  ReferenceSource* source_ = nullptr;
  ClockRegulator regulator_;
  std::uint64_t updates_ = 0;
  std::int64_t shown_ns_ = 0;  // by the reference, in the newest pair
  Shared known_;

  Seqlock<Shared> shared_;
  std::atomic<Duration::rep> last_poll_{0};

  std::atomic<bool> has_source_{false};
  std::atomic<bool> reporting_{false};  // the thread that sets it owns the next one
  std::uint64_t reports_ = 0;
  Seqlock<Report> report_;
};

/// How one cyclic task follows the clock.
class ClockFollower {
 public:
  ClockFollower(DistributedClock& clock, int iec_priority) noexcept;

  /// While the task is parked. Set-up.
  void begin() noexcept;

  /// How much to move `release`, which is planned next, at `now`; never more than the bound. 0 if there is no
  /// reference. The task's thread, real-time.
  [[nodiscard]] Duration correction(TimePoint release, Duration interval, Duration offset,
                                    TimePoint now) noexcept {
    return clock_.active() ? follow(release, interval, offset, now) : Duration::zero();
  }

 private:
  friend class DistributedClock;
  [[nodiscard]] Duration follow(TimePoint release, Duration interval, Duration offset,
                                TimePoint now) noexcept;
  void note(Duration correction, bool at_bound) noexcept;

  DistributedClock& clock_;
  int iec_priority_;
  DistributedClock::Shared known_;  // as last seen
  SyncWatch sync_;

  // For status().
  std::atomic<bool> in_sync_{false};
  std::atomic<std::int64_t> offset_ns_{0};
  std::atomic<std::int64_t> correction_ns_{0};
  std::atomic<std::int64_t> correction_max_ns_{0};
  std::atomic<std::uint64_t> at_bound_{0};
};

}  // namespace plchost
