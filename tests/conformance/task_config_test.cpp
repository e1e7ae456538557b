#include "tests/conformance/scheduler_fixture.hpp"

namespace plchost {
namespace {

struct BadTask {
  const char* why;
  const char* told;
  void (*spoil)(TaskConfig&);
};

class TaskConfigs : public testing::TestWithParam<BadTask> {};

TEST_P(TaskConfigs, ThatAreNotValidAreRefusedWithTheNameOfTheTask) {
  Tasks<LinuxClock> tasks;
  TaskConfig task = tasks.cyclic("main", std::chrono::milliseconds(1), [] {});
  tasks.add(tasks.cyclic("good", std::chrono::milliseconds(1), [] {}));
  GetParam().spoil(task);
  tasks.add(task);
  const auto made = tasks.create();
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::invalid_argument);
  EXPECT_THAT(made.error().message, testing::HasSubstr("'" + task.name + "'"));
  EXPECT_THAT(made.error().message, testing::HasSubstr(GetParam().told));
}

INSTANTIATE_TEST_SUITE_P(
    Each, TaskConfigs,
    testing::Values(
        BadTask{"NoName", "1 to 50", [](TaskConfig& task) { task.name = ""; }},
        BadTask{"NameTooLong", "1 to 50", [](TaskConfig& task) { task.name = std::string(51, 'a'); }},
        BadTask{"NameTwice", "another task", [](TaskConfig& task) { task.name = "good"; }},
        BadTask{"PriorityTooHigh", "0 (highest) to 31", [](TaskConfig& task) { task.iec_priority = -1; }},
        BadTask{"PriorityTooLow", "0 (highest) to 31", [](TaskConfig& task) { task.iec_priority = 32; }},
        BadTask{"NoInterval", "interval above 0", [](TaskConfig& task) { task.interval = Duration::zero(); }},
        BadTask{"NegativeInterval", "interval above 0",
                [](TaskConfig& task) { task.interval = Duration(-1); }},
        BadTask{"IntervalTooLong", "at most 50 days",
                [](TaskConfig& task) { task.interval = kMaxInterval + Duration(1); }},
        BadTask{"NoEvent", "external event", [](TaskConfig& task) { task.kind = TaskKind::external; }},
        BadTask{"NoVariable", "BOOL variable", [](TaskConfig& task) { task.kind = TaskKind::event; }},
        BadTask{"NoCode", "no code", [](TaskConfig& task) { task.entry = {}; }},
        BadTask{"NoSuchKind", "0 cyclic, 1 event, 2 external, 3 freewheeling",
                [](TaskConfig& task) { task.kind = TaskKind{4}; }}),
    [](const auto& bad) { return std::string(bad.param.why); });

TEST(TaskConfigsAtTheirBounds, AreAccepted) {
  ManualTasks tasks;
  TaskConfig task = ManualTasks::cyclic(std::string(50, 'a'), kMaxInterval, [] {});
  task.iec_priority = kLowestIecPriority;
  tasks.add(task);
  task = ManualTasks::cyclic("shortest", Duration(1), [] {});
  task.iec_priority = 0;
  tasks.add(task);
  EXPECT_TRUE(tasks.create());
}

TEST(TaskSetWithoutTasks, StartsSwitchesAndStops) {
  ManualTasks tasks;
  ASSERT_TRUE(tasks.create());
  tasks.start("CmpSchedule");
  tasks.clock.run_for(std::chrono::milliseconds(10));
  for (const std::string_view other : every_scheduler()) EXPECT_TRUE(tasks.set->switch_to(other, {}));
  EXPECT_TRUE(tasks.set->stop(std::chrono::seconds(1)));
}

}  // namespace
}  // namespace plchost
