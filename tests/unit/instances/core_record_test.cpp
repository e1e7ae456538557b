// The cause of lost cycles, from the entries of the flight recorder.
#include "instances/runtime/tasks/core_record.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace plchost {
namespace {

constexpr std::int64_t kMs = 1'000'000;

TimePoint at_ms(std::int64_t ms) {
  return TimePoint(Duration(ms * kMs));
}

/// A fast task above, the one that loses, and one below, all on one core. Times in ms.
class CauseOfALoss : public testing::Test {
 protected:
  static constexpr std::size_t kAbove = 0;
  static constexpr std::size_t kLoser = 1;
  static constexpr std::size_t kBelow = 2;

  CauseOfALoss() {
    for (std::size_t i = 0; i < tasks_.size(); ++i) tasks_[i].iec_priority = static_cast<std::int32_t>(i);
  }
  void cycle(std::size_t task, std::int64_t release, std::int64_t start, std::int64_t end) {
    put(kFirstTaskRing + task, start, FlightKind::start, (start - release) * kMs);
    put(kFirstTaskRing + task, end, FlightKind::end, 0);
  }
  void put(std::size_t ring, std::int64_t time, FlightKind kind, std::int64_t figure) {
    rings_.at(ring).push_back({.time_ns = time * kMs, .kind = kind, .figure = figure});
  }
  void lost(std::int64_t time, std::int64_t cycles) {
    put(kFirstTaskRing + kLoser, time, FlightKind::lost, cycles);
    put(kFirstTaskRing + kLoser, time, FlightKind::start, 0);
  }
  CoreRecord record(bool one_core = true) {
    CoreRecord made(tasks_, one_core);
    for (std::size_t ring = 0; ring < rings_.size(); ++ring) made.add(ring, rings_[ring], 0);
    if (above_stopped_at_ms_ != 0) made.add_fault(kAbove, at_ms(above_stopped_at_ms_));
    made.complete(at_ms(1000));
    return made;
  }
  /// The interval is 10 ms. `stall`: so much of its own part it got no processor, by the kernel.
  LossCause cause(Duration stall = {}) {
    const CoreRecord made = record();
    const auto& losses = made.losses(kLoser);
    EXPECT_EQ(losses.size(), 1U);
    if (losses.empty()) return LossCause::unknown;
    share_ = made.share(kLoser, losses[0].release, losses[0].ready);
    return cause_of(losses[0], share_, stall, std::chrono::milliseconds(10));
  }

  std::vector<FlightTask> tasks_{3};
  std::vector<std::vector<FlightEntry>> rings_{kFirstTaskRing + 3};
  CoreRecord::Share share_;
  std::int64_t above_stopped_at_ms_ = 0;  // by a fault; 0: it was not
};

TEST_F(CauseOfALoss, IsItsOwnOverrunIfItsCycleTookLongerThanTheIntervalByItself) {
  cycle(kLoser, 100, 101, 125);
  lost(130, 2);
  EXPECT_EQ(cause(), LossCause::long_cycle);
  EXPECT_EQ(share_.own, std::chrono::milliseconds(24));
  EXPECT_EQ(share_.none, std::chrono::milliseconds(1));
}

TEST_F(CauseOfALoss, IsTheTaskAboveThatHasPreEmptedIt) {
  cycle(kLoser, 100, 100, 114);
  cycle(kAbove, 103, 103, 112);
  lost(120, 1);
  EXPECT_EQ(cause(), LossCause::task_above) << "5 ms of its own would have fitted";
  EXPECT_EQ(share_.above, std::chrono::milliseconds(9));
  EXPECT_EQ(share_.holder, kAbove);
}

TEST_F(CauseOfALoss, IsTheTaskAboveThatHadTheCoreWhenItWasReleased) {
  cycle(kAbove, 95, 95, 118);
  cycle(kLoser, 100, 118, 119);
  lost(120, 1);
  EXPECT_EQ(cause(), LossCause::task_above);
  EXPECT_EQ(share_.of_holder, std::chrono::milliseconds(18));
}

TEST_F(CauseOfALoss, IsNoTaskBelow) {
  cycle(kBelow, 95, 95, 130);
  cycle(kLoser, 100, 100, 125);
  lost(130, 2);
  EXPECT_EQ(cause(), LossCause::long_cycle);
  EXPECT_EQ(share_.above, Duration::zero());
}

TEST_F(CauseOfALoss, OnSeveralCoresATaskAboveKeepsNobodyFromThem) {
  cycle(kLoser, 100, 100, 125);
  cycle(kAbove, 101, 101, 124);
  lost(130, 2);
  const CoreRecord made = record(false);
  EXPECT_EQ(made.share(kLoser, at_ms(100), at_ms(125)).own, std::chrono::milliseconds(25));
}

TEST_F(CauseOfALoss, IsAStallIfNothingOfTheInstanceHadTheCoreAfterItsRelease) {
  cycle(kLoser, 100, 120, 121);
  lost(130, 2);
  EXPECT_EQ(cause(), LossCause::stall);
  EXPECT_EQ(share_.none, std::chrono::milliseconds(20));
}

TEST_F(CauseOfALoss, IsAStallIfTheKernelGaveItNoProcessorInItsCycle) {
  cycle(kLoser, 100, 100, 125);
  lost(130, 2);
  EXPECT_EQ(cause(std::chrono::milliseconds(20)), LossCause::stall);
}

TEST_F(CauseOfALoss, IsAStallIfTheSupervisionAboveAllTasksCouldNotRunEither) {
  cycle(kLoser, 100, 100, 125);
  put(kWatchRing, 124, FlightKind::late, 22 * kMs);
  lost(130, 2);
  EXPECT_EQ(cause(), LossCause::stall);
}

TEST_F(CauseOfALoss, IsTheExchangeOfTheScheduler) {
  cycle(kLoser, 100, 100, 113);
  put(kControlRing, 112, FlightKind::switched, 11 * kMs);
  lost(120, 1);
  EXPECT_EQ(cause(), LossCause::scheduler);
}

TEST_F(CauseOfALoss, IsAnOnlineChangeThatHeldAllTasks) {
  cycle(kLoser, 100, 115, 116);
  put(kControlRing, 115, FlightKind::held, 15 * kMs);
  lost(120, 1);
  EXPECT_EQ(cause(), LossCause::online_change);
}

TEST_F(CauseOfALoss, IsTheDebuggerThatHeldItsCode) {
  put(kFirstTaskRing + kLoser, 100, FlightKind::start, 0);
  put(kFirstTaskRing + kLoser, 101, FlightKind::halted, 0);
  put(kFirstTaskRing + kLoser, 140, FlightKind::resumed, 0);
  put(kFirstTaskRing + kLoser, 141, FlightKind::end, 0);
  lost(150, 1);
  EXPECT_EQ(cause(), LossCause::halt);
  EXPECT_EQ(share_.own, std::chrono::milliseconds(2));
}

TEST_F(CauseOfALoss, IsTheRuntimesOwnWorkBehindItsCycle) {
  cycle(kLoser, 100, 100, 102);
  put(kFirstTaskRing + kLoser, 115, FlightKind::work, 13 * kMs);
  lost(120, 1);
  EXPECT_EQ(cause(), LossCause::runtime);
}

TEST_F(CauseOfALoss, IsTheReadingOfAnEventVariableThatTookLong) {
  cycle(kLoser, 100, 114, 115);
  put(kPollRing, 114, FlightKind::polled, 14 * kMs);
  lost(120, 1);
  EXPECT_EQ(cause(), LossCause::event_variable);
}

TEST_F(CauseOfALoss, IsTheStartOfTheTasksIfThatCameMeanwhile) {
  cycle(kLoser, 100, 100, 125);
  put(kControlRing, 110, FlightKind::started, 0);
  lost(130, 2);
  EXPECT_EQ(cause(), LossCause::start);
}

TEST_F(CauseOfALoss, IsUnknownIfTheCycleBeforeIsNotInTheRecord) {
  lost(130, 2);
  EXPECT_EQ(cause(), LossCause::unknown);
}

TEST_F(CauseOfALoss, IsUnknownIfEntriesOfATaskAboveSinceItsReleaseWereWrittenOver) {
  cycle(kAbove, 124, 124, 125);
  cycle(kBelow, 128, 128, 129);
  cycle(kLoser, 100, 126, 127);
  lost(130, 2);
  const auto known = [&](std::size_t written_over, bool one_core = true) {
    CoreRecord made(tasks_, one_core);
    for (std::size_t ring = 0; ring < rings_.size(); ++ring) {
      made.add(ring, rings_[ring], ring == written_over ? 7 : 0);
    }
    made.complete(at_ms(1000));
    return made.losses(kLoser).at(0).release == at_ms(100);
  };
  EXPECT_FALSE(known(kFirstTaskRing + kAbove)) << "it may have had the core, so this is no stall";
  EXPECT_FALSE(known(kControlRing)) << "of these not even one entry is left";
  EXPECT_TRUE(known(kFirstTaskRing + kBelow));
  EXPECT_TRUE(known(kFirstTaskRing + kAbove, false));
  rings_.at(kFirstTaskRing + kAbove)
      .insert(rings_.at(kFirstTaskRing + kAbove).begin(), {.time_ns = 99 * kMs});
  EXPECT_TRUE(known(kFirstTaskRing + kAbove)) << "all since the release is there";
}

TEST_F(CauseOfALoss, ATaskThatAFaultHasStoppedHoldsNoCore) {
  put(kFirstTaskRing + kAbove, 50, FlightKind::start, 0);  // it never ends
  above_stopped_at_ms_ = 52;
  cycle(kLoser, 100, 100, 125);
  lost(130, 2);
  EXPECT_EQ(cause(), LossCause::long_cycle);
}

TEST_F(CauseOfALoss, OfTwoTasksAboveTheOneOfTheHigherPriorityHadTheCore) {
  tasks_[kBelow].iec_priority = 1;  // as the one that loses: it pre-empts nobody, and is not pre-empted
  cycle(kBelow, 90, 90, 125);
  cycle(kAbove, 100, 100, 110);
  cycle(kLoser, 100, 125, 126);
  lost(130, 2);
  EXPECT_EQ(cause(), LossCause::task_above);
  EXPECT_EQ(share_.above, std::chrono::milliseconds(25));
  EXPECT_EQ(share_.holder, kBelow);
  EXPECT_EQ(share_.of_holder, std::chrono::milliseconds(15));
}

TEST_F(CauseOfALoss, EachLossHasTheNumberOfItsEntry) {
  cycle(kLoser, 100, 100, 125);
  lost(130, 2);
  const CoreRecord made = record();
  EXPECT_EQ(made.losses(kLoser).front().entry, 2U);
  EXPECT_EQ(made.ended(kLoser, at_ms(100), at_ms(125)).cycles, 1U);
  EXPECT_EQ(made.ended(kLoser, at_ms(125), at_ms(200)).cycles, 0U);
}

}  // namespace
}  // namespace plchost
