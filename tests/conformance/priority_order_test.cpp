#include <algorithm>
#include <array>
#include <span>

#include <sched.h>

#include "tests/conformance/scheduler_fixture.hpp"

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

class PriorityOrder : public testing::TestWithParam<std::string_view>, public Tasks<LinuxClock> {};

// The threads of this test inherit its core: one of those that are allowed.
bool bind_to_one_core() {
  const auto cores = allowed_cores(0);
  if (!cores || cores->empty()) return false;
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(static_cast<std::size_t>(cores->back()), &one);
  return ::sched_setaffinity(0, sizeof one, &one) == 0;
}

TEST_P(PriorityOrder, TasksThatAreDueTogetherRunOneAfterTheOtherByPriority) {
  constexpr std::size_t kTasks = 4;
  unprivileged = false;
  cpu_set_t before;
  CPU_ZERO(&before);
  ASSERT_EQ(::sched_getaffinity(0, sizeof before, &before), 0);
  ASSERT_TRUE(bind_to_one_core());
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
  if (!created && created.error().code == ErrorCode::refused) {
    ::sched_setaffinity(0, sizeof before, &before);
    GTEST_SKIP() << created.error().describe();
  }
  ASSERT_TRUE(created) << created.error().describe();
  ASSERT_TRUE(set->start(GetParam(), {}));
  std::this_thread::sleep_for(milliseconds(300));
  ASSERT_TRUE(set->stop(seconds(10)));
  set.reset();
  ::sched_setaffinity(0, sizeof before, &before);
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

INSTANTIATE_TEST_SUITE_P(Each, PriorityOrder, testing::ValuesIn(every_scheduler()), scheduler_test_name);

}  // namespace
}  // namespace plchost
