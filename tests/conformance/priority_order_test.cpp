#include <algorithm>
#include <array>
#include <span>

#include "tests/conformance/scheduler_fixture.hpp"
#include "tests/support/one_core.hpp"

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

// Without the right to SCHED_FIFO there is no order to see, and nothing is proven: that is a failure.
class PriorityOrder : public testing::TestWithParam<std::string_view>, public Tasks<LinuxClock> {
 protected:
  void SetUp() override {
    ASSERT_TRUE(may_use_fifo()) << "SCHED_FIFO is not allowed: run as root, or with CAP_SYS_NICE";
  }
};

TEST_P(PriorityOrder, TasksThatAreDueTogetherRunOneAfterTheOtherByPriority) {
  constexpr std::size_t kTasks = 4;
  unprivileged = false;
  const OneCore core;
  ASSERT_TRUE(core.bound());
  // Each cycle notes its priority; on one core, nobody else of the same set is in between.
  std::array<int, 10'000> noted{};
  std::atomic<std::size_t> next{0};
  constexpr std::array<int, kTasks> kPriorities{9, 2, 15, 5};
  for (const int priority : kPriorities) {
    TaskConfig task =
        cyclic("prio" + std::to_string(priority), milliseconds(2), [this, &noted, &next, priority] {
          if (const std::size_t at = next.fetch_add(1); at < noted.size()) noted[at] = priority;
          clock.spin_until(clock.now() + microseconds(30));
        });
    task.iec_priority = priority;
    add(task);
  }
  const auto created = create();
  ASSERT_TRUE(created) << created.error().describe();
  ASSERT_TRUE(set->start(GetParam(), {}));
  std::this_thread::sleep_for(milliseconds(300));
  ASSERT_TRUE(set->stop(seconds(10)));
  set.reset();
  const std::span<const int> order(noted.data(), std::min(next.load(), noted.size()));
  ASSERT_GE(order.size(), 4 * kTasks);
  // A host that takes the core away may make a release lost for some of them; the rounds that are whole are
  // in order.
  std::size_t ordered = 0;
  const std::vector<int> expected{2, 5, 9, 15};
  for (std::size_t i = 0; i + kTasks <= order.size(); ++i) {
    const auto first = order.begin() + static_cast<std::ptrdiff_t>(i);
    ordered += std::equal(expected.begin(), expected.end(), first) ? kTasks : 0U;
  }
  EXPECT_GE(ordered, order.size() * 9 / 10);
}

// A task of each priority, every 5 ms, on one core. The first cycles are left out.
struct Overlap {
  Duration high_offset;
  Duration low_offset;
  Duration high_takes;
  Duration low_takes;
};

class OverlappingReleases : public PriorityOrder {
 protected:
  void run(const Overlap& overlap) {
    unprivileged = false;
    add(task("high", 2, overlap.high_offset, overlap.high_takes, high));
    add(task("low", 9, overlap.low_offset, overlap.low_takes, low));
    const auto created = create();
    ASSERT_TRUE(created) << created.error().describe();
    ASSERT_TRUE(set->start(GetParam(), {}));
    std::this_thread::sleep_for(milliseconds(500));
    ASSERT_TRUE(set->stop(seconds(10)));
    set.reset();
  }
  // The value that 9 of 10 cycles are not below.
  static Duration usual_least(std::vector<std::int64_t> values) {
    if (values.size() < 20) return Duration::zero();
    std::ranges::sort(values);
    return Duration(values[values.size() / 10]);
  }

  struct Seen {
    std::vector<std::int64_t> latency;
    std::vector<std::int64_t> execution;
  };
  Seen high;
  Seen low;
  OneCore core;

 private:
  TaskConfig task(std::string name, int priority, Duration offset, Duration takes, Seen& seen) {
    TaskConfig config = cyclic(std::move(name), milliseconds(5), [this, takes] {
      const Duration until = clock.thread_time() + takes;
      while (clock.thread_time() < until) {
      }
    });
    config.iec_priority = priority;
    config.start_offset = offset;
    seen.latency.reserve(10'000);
    seen.execution.reserve(10'000);
    config.after_cycle = [&seen](const TaskCounters& now) {
      if (seen.latency.size() == seen.latency.capacity()) return;
      seen.latency.push_back(now.latency_last_ns);
      seen.execution.push_back(now.exec_last_ns);
    };
    return config;
  }
};

TEST_P(OverlappingReleases, AtTheSameTimeDelayTheLowerPriorityAndItsLatencyShowsIt) {
  ASSERT_NO_FATAL_FAILURE(
      run({.high_offset = {}, .low_offset = {}, .high_takes = microseconds(800), .low_takes = {}}));
  EXPECT_GE(usual_least(low.latency), microseconds(800));
  EXPECT_LT(usual_least(high.latency), usual_least(low.latency));
}

TEST_P(OverlappingReleases, DuringACycleOfHigherPriorityWaitForItsEndAndTheirLatencyShowsIt) {
  ASSERT_NO_FATAL_FAILURE(run(
      {.high_offset = {}, .low_offset = milliseconds(1), .high_takes = microseconds(1400), .low_takes = {}}));
  EXPECT_GE(usual_least(low.latency), microseconds(300));
}

TEST_P(OverlappingReleases, OfHigherPriorityPreEmptACycleAndItsExecutionTimeShowsIt) {
  // Little enough that another of these tests finds room on the same core.
  ASSERT_NO_FATAL_FAILURE(run({.high_offset = milliseconds(1),
                               .low_offset = {},
                               .high_takes = microseconds(400),
                               .low_takes = microseconds(1400)}));
  // The time of the other came in between, where the lower one had begun before it.
  std::vector<std::int64_t> pre_empted;
  for (std::size_t i = 0; i < low.latency.size(); ++i) {
    if (Duration(low.latency[i]) < microseconds(900)) pre_empted.push_back(low.execution[i]);
  }
  ASSERT_FALSE(pre_empted.empty()) << "others had the core each time";
  std::ranges::sort(pre_empted);
  EXPECT_GE(Duration(pre_empted[pre_empted.size() / 4]), microseconds(1750));
}

INSTANTIATE_TEST_SUITE_P(Each, OverlappingReleases, testing::ValuesIn(every_scheduler()),
                         scheduler_test_name);

INSTANTIATE_TEST_SUITE_P(Each, PriorityOrder, testing::ValuesIn(every_scheduler()), scheduler_test_name);

}  // namespace
}  // namespace plchost
