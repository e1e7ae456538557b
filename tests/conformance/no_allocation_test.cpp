#include <atomic>
#include <cstdlib>
#include <new>

#include <gtest/gtest.h>

#include "tests/conformance/scheduler_fixture.hpp"

// Counts every allocation of the program while it is told to. The sanitizers have a malloc of their own, with
// hooks.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
// g++ has the function, not the header.
extern "C" int
__sanitizer_install_malloc_and_free_hooks(  // NOLINT(bugprone-reserved-identifier): the sanitizer's own
    void (*malloc_hook)(const volatile void*, std::size_t), void (*free_hook)(const volatile void*));
#define PLCHOST_COUNTS_MALLOC 0
#else
#define PLCHOST_COUNTS_MALLOC 1
#endif

namespace {

std::atomic<bool> counting{false};
std::atomic<std::uint64_t> allocations{0};

void count_one() noexcept {
  if (counting.load(std::memory_order_relaxed)) allocations.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace

#if PLCHOST_COUNTS_MALLOC
// operator new comes by here too.
extern "C" {
void* __libc_malloc(std::size_t size);  // NOLINT(bugprone-reserved-identifier): glibc's own
void* __libc_calloc(std::size_t count, std::size_t size);  // NOLINT(bugprone-reserved-identifier)
void* __libc_realloc(void* memory, std::size_t size);      // NOLINT(bugprone-reserved-identifier)
void* malloc(std::size_t size) {
  count_one();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  count_one();
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  count_one();
  return __libc_realloc(memory, size);
}
}
#else
namespace {

const int hooked = __sanitizer_install_malloc_and_free_hooks(
    [](const volatile void*, std::size_t) { count_one(); }, [](const volatile void*) {});

}  // namespace
#endif

namespace plchost {
namespace {

using std::chrono::microseconds;

class NoAllocation : public testing::TestWithParam<std::string_view>, public Tasks<LinuxClock> {};

TEST_P(NoAllocation, InAHundredThousandCyclesOfAllKinds) {
  constexpr std::uint64_t kCycles = 100'000;
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
  ASSERT_TRUE(set->start(GetParam(), settings));
  for (std::size_t i = 0; i < 5; ++i) wait_for_cycles(i, 10);
  const std::uint64_t before = cycles;
  allocations = 0;
  counting = true;
  while (cycles - before < kCycles) std::this_thread::yield();
  counting = false;
  EXPECT_EQ(allocations, 0U);
  ASSERT_TRUE(set->stop(std::chrono::seconds(30)));
}

TEST(NoAllocationProbe, SeesAnAllocation) {
  allocations = 0;
  counting = true;
  ::operator delete(::operator new(8));  // not a new-expression: that one might be left out
  counting = false;
#if !PLCHOST_COUNTS_MALLOC
  ASSERT_GT(hooked, 0);
#endif
  EXPECT_GE(allocations, 1U);
}

INSTANTIATE_TEST_SUITE_P(Each, NoAllocation, testing::ValuesIn(every_scheduler()), scheduler_test_name);

}  // namespace
}  // namespace plchost
