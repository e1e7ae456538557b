#include <atomic>
#include <cstdio>
#include <cstdlib>

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <time.h>

#include "tests/conformance/malloc_count.hpp"
#include "tests/conformance/scheduler_fixture.hpp"
#include "tests/support/sanitized.hpp"

namespace plchost {
namespace {

// PLCHOST_CYCLES=1000000 for as many under each scheduler.
std::uint64_t cycles_to_run() {
  const char* const given = std::getenv("PLCHOST_CYCLES");
  if (given != nullptr) return std::strtoull(given, nullptr, 10);
  return kSanitized ? 10'000 : 100'000;
}

struct Usage {
  rusage thread{};
  rusage process{};
  Duration processor{};

  static Usage now(const Clock& clock) noexcept {
    Usage usage;
    ::getrusage(RUSAGE_THREAD, &usage.thread);
    ::getrusage(RUSAGE_SELF, &usage.process);
    usage.processor = clock.thread_time();
    return usage;
  }
};

class ZeroCost : public testing::TestWithParam<std::string_view>, public Tasks<LinuxClock> {};

// An empty task with its statistics: nothing is faulted in, nothing allocated, and the thread gives up the
// processor only to wait for its next release.
TEST_P(ZeroCost, OfAnEmptyTaskBesideItsWaits) {
  constexpr Duration kInterval = std::chrono::microseconds(40);
  constexpr std::uint64_t kWarmUp = 1000;
  const std::uint64_t cycles = cycles_to_run();
  // Like an instance, if it is allowed.
  ::mlockall(MCL_CURRENT | MCL_FUTURE);
  unprivileged = !may_use_fifo();
  Usage before;
  Usage after;
  std::uint64_t allocations = 0;
  std::uint64_t cycle = 0;
  std::atomic<bool> done{false};
  add(cyclic("empty", kInterval, [&] {
    if (cycle == kWarmUp) {
      before = Usage::now(clock);
      MallocCount::begin();
    }
    if (cycle == kWarmUp + cycles) {
      allocations = MallocCount::end();
      after = Usage::now(clock);
      done = true;
      done.notify_one();
    }
    ++cycle;
  }));
  ASSERT_TRUE(create());
  SchedulerSettings settings;
  settings.scheduler_interval = kInterval;
  settings.watchdog.load = false;  // with a sanitizer the interval may be shorter than a cycle
  ASSERT_TRUE(set->start(GetParam(), settings));
  done.wait(false);
  ASSERT_TRUE(set->stop(std::chrono::seconds(30)));
  ::munlockall();
  EXPECT_EQ(allocations, 0U);
  if (!kSanitized) {
    EXPECT_EQ(after.thread.ru_minflt - before.thread.ru_minflt, 0);
    EXPECT_EQ(after.process.ru_majflt - before.process.ru_majflt, 0);
  }
  const auto voluntary = static_cast<std::uint64_t>(after.thread.ru_nvcsw - before.thread.ru_nvcsw);
  const TaskCounters now = counters(0);
  // A release that is lost at the very end of a cycle may still end a wait.
  EXPECT_LE(voluntary, cycles + now.lost_cycles);
  std::printf(
      "%llu cycles: %llu voluntary switches, %.0f ns of the task's processor time per cycle, %llu lost, %lld "
      "ns spun per cycle\n",
      static_cast<unsigned long long>(cycles), static_cast<unsigned long long>(voluntary),
      static_cast<double>((after.processor - before.processor).count()) / static_cast<double>(cycles),
      static_cast<unsigned long long>(now.lost_cycles),
      static_cast<long long>(now.spin_sum_ns) / static_cast<long long>(now.cycles));
}

INSTANTIATE_TEST_SUITE_P(Each, ZeroCost, testing::ValuesIn(every_scheduler()), scheduler_test_name);

}  // namespace
}  // namespace plchost
