#include "schedulers/tick/ticker.hpp"

#include <atomic>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/manual_clock.hpp"

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using testing::ElementsAre;

/// Notes of which ticks it is told.
class NotingScheduler final : public Scheduler {
 public:
  [[nodiscard]] std::string_view name() const noexcept override { return "Noting"; }
  [[nodiscard]] SchedulerCapabilities capabilities() const noexcept override { return {.ticks = true}; }
  [[nodiscard]] Result<std::unique_ptr<ActivationSource>> source_for(Task&) override { return nullptr; }
  void on_tick(TimePoint tick) noexcept override { told.push_back(tick); }
  std::vector<TimePoint> told;
};

/// As if each tick were held up for ever.
class SilentSource final : public TickSource {
 public:
  explicit SilentSource(Clock& clock) noexcept : clock_(clock) {}
  void start(TimePoint, Duration) noexcept override {}
  std::optional<TimePoint> wait() noexcept override {
    (void)gate_.wait(clock_);
    return std::nullopt;
  }
  void interrupt() noexcept override { gate_.interrupt(clock_); }

 private:
  Clock& clock_;
  ActivationGate gate_;
};

class TickerTest : public testing::Test {
 protected:
  TickerTest() {
    TaskConfig config;
    config.name = "edge";
    config.kind = TaskKind::event;
    config.event_variable = [this] {
      looks.push_back(clock_.now());
      return false;
    };
    task_ = std::make_unique<Task>(clock_, std::move(config), statistics_, nullptr);
    poller_.add(*task_);
    EXPECT_TRUE(sut.start_thread({}));
    use(first_look_);
    looks.clear();
  }

  [[nodiscard]] TickPlan plan(Scheduler* scheduler) {
    auto source = make_tick_source(clock_, {.kind = TickSourceKind::task, .device = {}, .fallback = {}});
    return {.source = std::move(*source),
            .scheduler = scheduler,
            .origin = origin_,
            .period = milliseconds(1),
            .max_backlog = 1};
  }
  void use(TickPlan& plan) {
    sut.use(&plan);
    EXPECT_TRUE(sut.settled(kNoDeadline));
  }
  [[nodiscard]] TimePoint at(Duration since) const { return origin_ + since; }

  ManualClock clock_;
  TimePoint origin_ = clock_.now() + milliseconds(1);
  std::vector<TimePoint> looks;

 private:
  TaskStatistics statistics_{};
  std::unique_ptr<Task> task_;
  CycleGate gate_;
  EventPoller poller_{clock_, gate_};
  TickPlan first_look_;

 protected:
  NotingScheduler before_;
  NotingScheduler after_;
  TickPlan plan_before_ = plan(&before_);
  TickPlan plan_after_ = plan(&after_);
  Ticker sut{clock_, poller_};  // last: its thread uses the others
};

TEST_F(TickerTest, ExchangesTheSchedulerBetweenTwoTicksAndLeavesNoneOut) {
  use(plan_before_);
  clock_.run_until(at(microseconds(2500)));
  use(plan_after_);
  clock_.run_until(at(microseconds(4500)));
  EXPECT_THAT(before_.told,
              ElementsAre(at(-milliseconds(1)), at({}), at(milliseconds(1)), at(milliseconds(2))));
  EXPECT_THAT(after_.told, ElementsAre(at(milliseconds(2)), at(milliseconds(3)), at(milliseconds(4))))
      << "the first is the one that has passed";
  EXPECT_THAT(looks, ElementsAre(at({}), at(milliseconds(1)), at(milliseconds(2)), at(milliseconds(3)),
                                 at(milliseconds(4))));
}

TEST_F(TickerTest, MakesUpForATickThatFellDueInTheExchange) {
  plan_before_.source = std::make_unique<SilentSource>(clock_);
  use(plan_before_);
  clock_.run_until(at(microseconds(1200)));
  EXPECT_THAT(looks, ElementsAre());
  use(plan_after_);
  EXPECT_THAT(after_.told, ElementsAre(at(milliseconds(1))));
  EXPECT_THAT(looks, ElementsAre(at(microseconds(1200)))) << "without waiting for the next tick";
  clock_.run_until(at(microseconds(2500)));
  EXPECT_THAT(after_.told, ElementsAre(at(milliseconds(1)), at(milliseconds(2))));
}

TEST_F(TickerTest, RestsWithoutAPlanAndLooksAtNothingForTheTimeInWhichItHasRested) {
  use(plan_before_);
  clock_.run_until(at(microseconds(500)));
  sut.use(nullptr);
  ASSERT_TRUE(sut.settled(kNoDeadline));
  clock_.run_until(at(microseconds(5200)));
  EXPECT_THAT(before_.told, ElementsAre(at(-milliseconds(1)), at({})));
  use(plan_after_);
  EXPECT_THAT(looks, ElementsAre(at({})));
  clock_.run_until(at(microseconds(6500)));
  EXPECT_THAT(after_.told, ElementsAre(at(milliseconds(5)), at(milliseconds(6))));
  EXPECT_THAT(looks, ElementsAre(at({}), at(milliseconds(6))));
}

}  // namespace
}  // namespace plchost
