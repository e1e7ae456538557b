#include <algorithm>
#include <atomic>

#include "schedulers/distributed_clock/distributed_clock.hpp"
#include "schedulers/tasks/kinds/kind.hpp"
#include "schedulers/tasks/release_grid.hpp"

namespace plchost {

/// Runs at the points of a grid.
class CyclicKind final : public TaskKindState {
 public:
  static constexpr TaskKindEntry kEntry{.timed = true, .has_grid = true};

  explicit CyclicKind(const TaskKindContext& context) noexcept
      : config_(context.config),
        grid_(TimePoint{}, std::max(config_.interval, Duration(1)), config_.late),
        wanted_interval_(grid_.interval().count()) {}

  [[nodiscard]] static Result<void> check(const TaskConfig& task) {
    if (task.interval <= Duration::zero() || task.interval > kMaxInterval) {
      return bad_task(task, "a cyclic task needs an interval above 0 and at most " +
                                std::to_string(std::chrono::floor<std::chrono::days>(kMaxInterval).count()) +
                                " days; it has " + std::to_string(task.interval.count()) + " ns");
    }
    if (task.start_offset >= Duration::zero() && task.start_offset < task.interval) return {};
    return bad_task(task, "its start offset of " + std::to_string(task.start_offset.count()) +
                              " ns must be at least 0 and below its interval of " +
                              std::to_string(task.interval.count()) + " ns");
  }

  void begin(TimePoint origin, bool /*takes_posts*/) noexcept override {
    grid_ = ReleaseGrid(origin + config_.start_offset, interval(), config_.late);
    set_due(origin + config_.start_offset);
  }
  void cycle_begins(TimePoint release) noexcept override { set_due(release + interval()); }
  Duration cycle_ended(TimePoint release, TimePoint end) noexcept override {
    grid_.set_interval(interval());
    grid_.ran(release);
    if (follower_ == nullptr) return {};
    const Duration by = follower_->correction(grid_.next(), grid_.interval(), config_.start_offset, end);
    grid_.shift(by);
    return by;
  }

  std::uint64_t pass_over(TimePoint end, Duration still) noexcept override {
    const std::uint64_t passed = grid_.pass_over(std::min(end, grid_.next() + still));
    set_due(grid_.next());
    return passed;
  }

  [[nodiscard]] Activation next_release(TimePoint ready,
                                        const FreewheelRule& /*rule*/) const noexcept override {
    const auto [release, lost_cycles] = grid_.plan(ready);
    return {.release = release, .lost_cycles = lost_cycles};
  }
  [[nodiscard]] bool is_due(TimePoint now) const noexcept override { return *due() < now; }

  void follow(ClockFollower& follower) noexcept override { follower_ = &follower; }
  [[nodiscard]] const ClockFollower* follower() const noexcept override { return follower_; }
  [[nodiscard]] bool set_interval(Duration interval) noexcept override {
    if (interval < kMinRuntimeInterval || interval > kMaxInterval) return false;
    wanted_interval_.store(interval.count(), std::memory_order_relaxed);
    return true;
  }
  [[nodiscard]] Duration interval() const noexcept override {
    return Duration(wanted_interval_.load(std::memory_order_relaxed));
  }
  [[nodiscard]] Duration interval_in_force() const noexcept override { return grid_.interval(); }
  [[nodiscard]] std::optional<TimePoint> due() const noexcept override {
    return TimePoint(Duration(due_.load(std::memory_order_relaxed)));
  }

 private:
  void set_due(TimePoint due) noexcept {
    due_.store(due.time_since_epoch().count(), std::memory_order_relaxed);
  }

  const TaskConfig& config_;
  ReleaseGrid grid_;
  std::atomic<Duration::rep> wanted_interval_;  // of the grid, from the end of the next cycle on
  std::atomic<Duration::rep> due_{0};           // the first release that no cycle has begun for
  ClockFollower* follower_ = nullptr;
};

template <>
struct KindClass<TaskKind::cyclic> {
  using Type = CyclicKind;
};
template TaskKindEntry make_kind_entry<TaskKind::cyclic>();

}  // namespace plchost
