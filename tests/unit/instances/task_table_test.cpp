#include "instances/runtime/tasks/task_table.hpp"

#include <array>
#include <cstring>

#include <gtest/gtest.h>

#include "instances/runtime/application/application_host.hpp"
#include "instances/runtime/tasks/task_builder.hpp"
#include "tests/support/manual_clock.hpp"

namespace plchost {
namespace {

static_assert(PLC_MIN_INTERVAL_NS == kMinRuntimeInterval.count());
static_assert(PLC_MAX_INTERVAL_NS == Duration(kMaxInterval).count());

class TaskCalls : public testing::Test {
 protected:
  TaskCalls() {
    fill(infos_[0], "Fast", Cyclic);
    fill(infos_[1], "Loop", Freewheeling);
    fill(infos_[2], "Edge", Event);
    infos_[2].dwEventFunctionPointer = []() -> unsigned char { return 0; };
    setup_.nTasks = 3;
    setup_.ptaskinfo = infos_.data();
  }
  ~TaskCalls() override { host.task_table().attach(nullptr); }
  TaskCalls(const TaskCalls&) = delete;
  TaskCalls& operator=(const TaskCalls&) = delete;

  static void fill(Task_Info& info, const char* name, short kind) {
    std::strncpy(info.stName, name, sizeof info.stName - 1);
    info.KindOfTask = kind;
    info.dwInterval = 10;
    info.dwTaskEntryFunctionPointer = [] {};
  }

  void hand_over() {
    ApplicationDeclaration declaration;
    host.begin_init(declaration);
    __sys__setup__tasks(&setup_);
    host.end_init();
  }
  void make_tasks() {
    TaskEnvironment environment;
    environment.find_event = [](std::string_view) -> Result<CountedEvent*> { return nullptr; };
    environment.statistics = [this](std::size_t index) -> TaskStatistics& { return statistics_[index]; };
    environment.allow_unprivileged = true;
    auto made = TaskSet::create(clock_, PriorityBand::normal, build_tasks(setup_).value(), environment);
    ASSERT_TRUE(made) << made.error().describe();
    tasks_ = *std::move(made);
    host.task_table().attach(tasks_.get());
  }

  ApplicationHost host{"test", nullptr};
  std::array<Task_Info, 3> infos_{};
  sys_setup_tasks_struct setup_{};

 private:
  ManualClock clock_;
  std::array<TaskStatistics, 3> statistics_;
  std::unique_ptr<TaskSet> tasks_;
};

TEST_F(TaskCalls, FindTasksByNameOnceTheyWereHandedOver) {
  RTS_RESULT result = ERR_OK;
  EXPECT_EQ(SchedGetTaskHandle("Fast", &result), RTS_INVALID_HANDLE);
  EXPECT_EQ(result, ERR_NO_OBJECT);
  hand_over();
  const RTS_HANDLE fast = SchedGetTaskHandle("Fast", &result);
  EXPECT_NE(fast, RTS_INVALID_HANDLE);
  EXPECT_EQ(result, ERR_OK);
  EXPECT_NE(SchedGetTaskHandle("Loop", nullptr), fast);
  EXPECT_EQ(SchedGetTaskHandle("fast", &result), RTS_INVALID_HANDLE);
  EXPECT_EQ(result, ERR_NO_OBJECT);
  EXPECT_EQ(SchedGetTaskHandle(nullptr, &result), RTS_INVALID_HANDLE);
  EXPECT_EQ(result, ERR_PARAMETER);
}

TEST_F(TaskCalls, CurrentTaskIsTheOneWhoseCycleRuns) {
  hand_over();
  EXPECT_EQ(SchedGetCurrentTask(), RTS_INVALID_HANDLE);
  const CurrentTask current(&infos_[1]);
  EXPECT_EQ(SchedGetCurrentTask(), SchedGetTaskHandle("Loop", nullptr));
}

TEST_F(TaskCalls, IntervalIsReadAndSetToTheNanosecond) {
  hand_over();
  const RTS_HANDLE fast = SchedGetTaskHandle("Fast", nullptr);
  RTS_I64 interval = 0;
  EXPECT_EQ(SchedGetTaskInterval(fast, &interval), ERR_NOTINITIALIZED);
  EXPECT_EQ(SchedSetTaskInterval(fast, 1'000'001), ERR_NOTINITIALIZED);
  make_tasks();
  EXPECT_EQ(SchedGetTaskInterval(fast, &interval), ERR_OK);
  EXPECT_EQ(interval, 10'000'000);
  EXPECT_EQ(SchedSetTaskInterval(fast, 1'000'001), ERR_OK);
  EXPECT_EQ(SchedGetTaskInterval(fast, &interval), ERR_OK);
  EXPECT_EQ(interval, 1'000'001);
}

TEST_F(TaskCalls, RefuseHandlesOfNoCyclicTaskAndIntervalsOutOfRange) {
  hand_over();
  make_tasks();
  const RTS_HANDLE fast = SchedGetTaskHandle("Fast", nullptr);
  const RTS_HANDLE loop = SchedGetTaskHandle("Loop", nullptr);
  RTS_I64 interval = -7;
  EXPECT_EQ(SchedGetTaskInterval(loop, &interval), ERR_PARAMETER);
  EXPECT_EQ(SchedGetTaskInterval(nullptr, &interval), ERR_PARAMETER);
  EXPECT_EQ(SchedGetTaskInterval(RTS_INVALID_HANDLE, &interval), ERR_PARAMETER);
  EXPECT_EQ(SchedGetTaskInterval(fast, nullptr), ERR_PARAMETER);
  EXPECT_EQ(interval, -7);
  EXPECT_EQ(SchedSetTaskInterval(loop, 1'000'000), ERR_PARAMETER);
  EXPECT_EQ(SchedSetTaskInterval(nullptr, 1'000'000), ERR_PARAMETER);
  for (const RTS_I64 wrong :
       {RTS_I64{0}, RTS_I64{-1'000'000}, PLC_MIN_INTERVAL_NS - 1, PLC_MAX_INTERVAL_NS + 1}) {
    EXPECT_EQ(SchedSetTaskInterval(fast, wrong), ERR_PARAMETER) << wrong;
  }
  EXPECT_EQ(SchedSetTaskInterval(fast, PLC_MIN_INTERVAL_NS), ERR_OK);
}

TEST_F(TaskCalls, EventIsRaisedForEventTasksOnly) {
  hand_over();
  const RTS_HANDLE edge = SchedGetTaskHandle("Edge", nullptr);
  EXPECT_EQ(SchedRaiseEvent(edge), ERR_NOTINITIALIZED);
  make_tasks();
  EXPECT_EQ(SchedRaiseEvent(edge), ERR_OK);
  const EventLatch* const latch = host.task_table().task(edge)->latch();
  ASSERT_NE(latch, nullptr);
  EXPECT_TRUE(latch->is_raised());
  EXPECT_EQ(SchedRaiseEvent(SchedGetTaskHandle("Fast", nullptr)), ERR_PARAMETER);
  EXPECT_EQ(SchedRaiseEvent(RTS_INVALID_HANDLE), ERR_PARAMETER);
}

}  // namespace
}  // namespace plchost
