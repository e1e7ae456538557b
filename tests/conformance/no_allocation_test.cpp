#include <atomic>
#include <new>
#include <thread>

#include <gtest/gtest.h>

#include "tests/conformance/malloc_count.hpp"
#include "tests/conformance/scheduler_fixture.hpp"
#include "tests/support/sanitized.hpp"

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

class NoAllocation : public testing::TestWithParam<std::string_view>, public Tasks<LinuxClock> {};

TEST_P(NoAllocation, InManyCyclesOfAllKinds) {
  constexpr std::uint64_t kCycles = kSanitized ? 10'000 : 100'000;
  std::atomic<bool> variable{false};
  std::atomic<std::uint64_t> cycles{0};
  const auto entry = [&] { cycles.fetch_add(1, std::memory_order_relaxed); };
  add(cyclic("fast", microseconds(20), entry));
  add(cyclic("overrun", microseconds(30), [&] {
    entry();
    clock.spin_until(clock.now() + microseconds(50));
  }));
  add(event("edge", [&] { return variable.exchange(!variable); }, entry));
  add(external("posted", "ready", entry));
  TaskConfig poster = freewheeling("poster", [&] {
    entry();
    event_named("ready").post();
  });
  poster.after_cycle = [](const TaskCounters&) {};
  add(poster);
  ASSERT_TRUE(create());
  SchedulerSettings settings;
  settings.scheduler_interval = microseconds(20);
  settings.watchdog.load = false;  // as fast as it goes
  ASSERT_TRUE(set->start(GetParam(), settings));
  for (std::size_t i = 0; i < 5; ++i) wait_for_cycles(i, 10);
  const std::uint64_t before = cycles;
  MallocCount::begin();
  while (cycles - before < kCycles) std::this_thread::sleep_for(milliseconds(1));
  EXPECT_EQ(MallocCount::end(), 0U);
  ASSERT_TRUE(set->stop(std::chrono::seconds(30)));
}

TEST(NoAllocationProbe, SeesAnAllocation) {
  MallocCount::begin();
  ::operator delete(::operator new(8));  // not a new-expression: that one might be left out
  EXPECT_GE(MallocCount::end(), 1U);
}

INSTANTIATE_TEST_SUITE_P(Each, NoAllocation, testing::ValuesIn(every_scheduler()), scheduler_test_name);

}  // namespace
}  // namespace plchost
