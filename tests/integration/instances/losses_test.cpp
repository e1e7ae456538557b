// Each loss of cycles of a real plc-instance is told with its cause, which a test has injected on purpose.
#include <csignal>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "shm/base/cpu_list.hpp"
#include "shm/pages/flight_page.hpp"
#include "shm/threads/thread.hpp"
#include "tests/integration/instances/instance_process.hpp"

namespace plchost::testing {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kMs = 1'000'000;

class LossOfCycles : public ::testing::TestWithParam<const char*> {
 protected:
  explicit LossOfCycles(const std::string& scheduler = GetParam())
      : process_(sandbox_, {"--core", std::to_string(allowed_cores(0).value().back()), "--scheduler",
                            scheduler, "--application", application("losses")}) {
    process_.wait_until_up();
    EXPECT_TRUE(eventually([&] { return process_.task("Loser")->counters.cycles > 20; })) << process_.log();
  }

  std::vector<LossRecord> losses() {
    std::vector<LossRecord> found;
    const auto page = FlightPageReader::open(sandbox_.pool(), "line1");
    EXPECT_TRUE(page) << page.error().describe();
    for (std::size_t place = 0; page && place < kLossesKept; ++place) {
      if (const auto loss = page->loss(place)) found.push_back(*loss);
    }
    return found;
  }
  /// A loss of the task with this cause, which may be one of several: the machine has others for it, too. If
  /// it stands still just then, or another test uses the core, that is the cause. So `event`, which injects
  /// this one, is posted again and again, at times that such tests do not have in common.
  std::optional<LossRecord> told(LossCause cause, const char* event = nullptr,
                                 std::int64_t least_stall_ns = 0) {
    std::optional<LossRecord> found;
    TimePoint next_post;
    std::mt19937 random(std::random_device{}());
    std::uniform_int_distribution pause_ms(500, 1500);
    EXPECT_TRUE(eventually([&] {
      if (event != nullptr && MonotonicClock::now() >= next_post) {
        post(event);
        next_post = MonotonicClock::now() + std::chrono::milliseconds(pause_ms(random));
      }
      for (const LossRecord& loss : losses()) {
        const bool is_it = loss.cause == cause && loss.stall_ns >= least_stall_ns;
        if (is_it && loss.task.view() == "Loser") found = loss;
      }
      return found.has_value();
    })) << all();
    return found;
  }
  std::string all() {
    std::string text = process_.log();
    for (const LossRecord& loss : losses()) {
      text += "loss " + std::to_string(loss.number) + " of " + std::string(loss.task.view()) + ", cause " +
              std::to_string(static_cast<int>(loss.cause)) + ", lost " + std::to_string(loss.lost) +
              ", own " + std::to_string(loss.own_ns) + ", above " + std::to_string(loss.above_ns) +
              ", stall " + std::to_string(loss.stall_ns) + ", other " + std::to_string(loss.other_ns) + "\n";
    }
    return text;
  }
  void post(const std::string& event) { (void)process_.event(event).post(); }

  Sandbox sandbox_;
  InstanceProcess process_;
};

TEST_P(LossOfCycles, ByACycleThatTookTooLongIsToldAsItsOwn) {
  const auto loss = told(LossCause::long_cycle, "overrun");
  ASSERT_TRUE(loss);
  EXPECT_GE(loss->lost, 6U);
  EXPECT_GE(loss->own_ns, 20 * kMs) << all();
  EXPECT_EQ(loss->interval_ns, 5 * kMs);
}

TEST_P(LossOfCycles, ByATaskAboveNamesThatTask) {
  // It may come between two cycles of the other one, which then only starts late: with the next it loses.
  const auto loss = told(LossCause::task_above, "burst");
  ASSERT_TRUE(loss);
  EXPECT_EQ(loss->holder.view(), "Burst");
  EXPECT_GE(loss->above_ns, 20 * kMs) << all();
}

TEST_P(LossOfCycles, ByAProcessThatStoodStillIsAStall) {
  ASSERT_EQ(::kill(process_.pid(), SIGSTOP), 0);
  std::this_thread::sleep_for(60ms);
  ASSERT_EQ(::kill(process_.pid(), SIGCONT), 0);
  // The machine may stand still for a shorter time before.
  const auto loss = told(LossCause::stall, nullptr, 20 * kMs);
  ASSERT_TRUE(loss);
  EXPECT_GE(loss->lost, 3U) << all();
}

TEST_P(LossOfCycles, ByAnEventVariableThatTakesLongIsToldSo) {
  const auto loss = told(LossCause::event_variable, "variable");
  ASSERT_TRUE(loss);
  EXPECT_GE(loss->other_ns, 20 * kMs) << all();
}

TEST_P(LossOfCycles, OfATaskThatLostNoneIsNotTold) {
  ASSERT_TRUE(told(LossCause::long_cycle, "overrun"));
  for (const LossRecord& loss : losses()) EXPECT_EQ(loss.task.view(), "Loser");
}

INSTANTIATE_TEST_SUITE_P(Schedulers, LossOfCycles, ::testing::Values("CmpSchedule", "CmpScheduleOneShot"));

TEST(FlightRecorderOfAProcess, OutlivesItsKillAndIsRemovedAtAnOrderlyEnd) {
  Sandbox sandbox;
  {
    InstanceProcess process(sandbox, {"--application", application("losses")});
    process.wait_until_up();
    (void)process.event("relay").post();
    std::this_thread::sleep_for(100ms);
    const pid_t pid = process.pid();
    EXPECT_EQ(process.end(SIGKILL), -SIGKILL);
    const auto page = FlightPageReader::open(sandbox.pool(), "line1");
    ASSERT_TRUE(page) << page.error().describe();
    EXPECT_EQ(page->pid(), pid);
    std::size_t cycles = 0;
    bool posted = false;
    for (std::size_t task = 0; task < page->task_count(); ++task) {
      for (const FlightEntry& entry : page->read(kFirstTaskRing + task, 0).entries) {
        if (entry.kind == FlightKind::start) ++cycles;
        if (entry.kind == FlightKind::posted) posted = page->task_name(task) == "Relay";
      }
    }
    EXPECT_GT(cycles, 10U);
    EXPECT_TRUE(posted) << "a post has its origin";
  }
  InstanceProcess next(sandbox, {"--application", application("losses")});
  next.wait_until_up();
  EXPECT_EQ(next.end(SIGTERM), EXIT_SUCCESS);
  EXPECT_FALSE(FlightPageReader::open(sandbox.pool(), "line1"));
}

}  // namespace
}  // namespace plchost::testing
