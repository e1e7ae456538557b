#include "instances/runtime/tasks/task_builder.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <string_view>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace plchost {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

const Task_Info* seen_task = nullptr;
void cycle() {
  seen_task = plc_current_task();
}
unsigned char variable() {
  return 2;
}

template <std::size_t Size>
void set(char (&field)[Size], std::string_view text) {
  std::memcpy(field, text.data(), text.size());
  if (text.size() < Size) field[text.size()] = '\0';
}

class TaskBuilder : public ::testing::Test {
 protected:
  TaskBuilder() {
    set(setup_.stApplicationName, "Test");
    for (std::size_t i = 0; i < tasks_.size(); ++i) {
      set(tasks_[i].stName, std::string("Task") + static_cast<char>('0' + i));
      tasks_[i].KindOfTask = static_cast<short>(i);
      tasks_[i].dwTaskEntryFunctionPointer = cycle;
    }
    tasks_[Cyclic].dwInterval = 10;
    tasks_[Event].dwEventFunctionPointer = variable;
    set(tasks_[External].stExternalEvent, "ready");
    setup_.nTasks = static_cast<short>(tasks_.size());
    setup_.ptaskinfo = tasks_.data();
  }

  std::string complaint() {
    const auto built = build_tasks(setup_);
    return built ? std::string() : built.error().message;
  }

  std::array<Task_Info, 4> tasks_{};
  sys_setup_tasks_struct setup_{};
};

TEST_F(TaskBuilder, TranslatesAllFourKinds) {
  const auto sut = build_tasks(setup_);
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ((*sut)[0].interval, 10ms);
  EXPECT_TRUE((*sut)[1].event_variable());
  EXPECT_EQ((*sut)[2].external_event, "ready");
  EXPECT_EQ((*sut)[3].kind, TaskKind::freewheeling);
}

TEST_F(TaskBuilder, TakesTheIntervalInTheUnitItIsGiven) {
  tasks_[Cyclic].bMicroseconds = 1;
  EXPECT_EQ(build_tasks(setup_)->front().interval, 10us);
  tasks_[Cyclic].bMicroseconds = 0;
  tasks_[Cyclic].dwInterval = std::numeric_limits<unsigned>::max();
  EXPECT_EQ(build_tasks(setup_)->front().interval, std::chrono::milliseconds(4294967295));
}

TEST_F(TaskBuilder, TellsACycleWhoseItIs) {
  const auto sut = build_tasks(setup_);
  (*sut)[2].entry();
  EXPECT_EQ(seen_task, &tasks_[2]);
  EXPECT_EQ(plc_current_task(), nullptr);
}

TEST_F(TaskBuilder, NamesTheTaskAndFieldThatIsWrong) {
  tasks_[0].nPriority = 32;
  EXPECT_THAT(complaint(), HasSubstr("task 'Task0': nPriority 32 is not allowed: 0 (highest) to 31"));
  tasks_[0].nPriority = 0;
  tasks_[0].dwInterval = 0;
  EXPECT_THAT(complaint(), HasSubstr("task 'Task0': dwInterval"));
  tasks_[0].dwInterval = 1;
  tasks_[1].dwEventFunctionPointer = nullptr;
  EXPECT_THAT(complaint(), HasSubstr("task 'Task1': dwEventFunctionPointer"));
  tasks_[1].dwEventFunctionPointer = variable;
  set(tasks_[2].stExternalEvent, "");
  EXPECT_THAT(complaint(), HasSubstr("task 'Task2': stExternalEvent"));
  set(tasks_[2].stExternalEvent, "ready");
  tasks_[3].dwTaskEntryFunctionPointer = nullptr;
  EXPECT_THAT(complaint(), HasSubstr("task 'Task3': dwTaskEntryFunctionPointer is null"));
  tasks_[3].dwTaskEntryFunctionPointer = cycle;
  tasks_[3].KindOfTask = 4;
  EXPECT_THAT(complaint(), HasSubstr("task 'Task3': KindOfTask 4"));
}

TEST_F(TaskBuilder, RefusesBadNames) {
  set(tasks_[1].stName, "Task0");
  EXPECT_THAT(complaint(), HasSubstr("two tasks are called 'Task0'"));
  std::ranges::fill(tasks_[1].stName, 'x');
  EXPECT_THAT(complaint(), HasSubstr("task number 1: stName is longer than 50 characters"));
  set(tasks_[1].stName, "no spaces");
  EXPECT_THAT(complaint(), HasSubstr("task number 1: stName 'no spaces' is not valid"));
}

TEST_F(TaskBuilder, RefusesACountOutOfRange) {
  for (const short count : {-1, 0, PLC_MAX_TASKS + 1}) {
    setup_.nTasks = count;
    EXPECT_THAT(complaint(), HasSubstr("tasks (nTasks); allowed are 1 to 1024"));
  }
  setup_.nTasks = 4;
  setup_.ptaskinfo = nullptr;
  EXPECT_THAT(complaint(), HasSubstr("ptaskinfo is null"));
}

TEST(WriteBack, GivesMicrosecondsCutToWhatFits) {
  Task_Info task{};
  TaskCounters counters{};
  counters.cycles = 40;
  counters.recorded = 4;
  counters.exec_last_ns = 5'000;
  counters.exec_sum_ns = 40'000;
  counters.exec_max_ns = std::numeric_limits<std::int64_t>::max();
  counters.exec_min_ns = 2'999;
  counters.jitter_last_ns = -7'000;
  counters.jitter_min_ns = std::numeric_limits<std::int64_t>::min();
  write_back(counters, task);
  EXPECT_EQ(task.tLastCycleTime, 5);
  EXPECT_EQ(task.tAverageCycleTime, 10);
  EXPECT_EQ(task.tMaxCycleTime, std::numeric_limits<int>::max());
  EXPECT_EQ(task.tMinCycleTime, 2);
  EXPECT_EQ(task.tJitterLast, -7);
  EXPECT_EQ(task.tJitterMax, std::numeric_limits<int>::max()) << "the largest magnitude";
}

}  // namespace
}  // namespace plchost
