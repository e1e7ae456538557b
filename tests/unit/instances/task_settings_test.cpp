#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/runtime/tasks/task_builder.hpp"

namespace plchost {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

Task_Options zeroed() {
  Task_Options options{};
  options.dwSize = sizeof options;
  return options;
}

std::vector<TaskConfig> tasks() {
  std::vector<TaskConfig> made(2);
  made[0].name = "Fast";
  made[0].interval = 1ms;
  made[1].name = "Slow";
  made[1].interval = 10ms;
  for (TaskConfig& task : made) task.entry = [] {};
  return made;
}

TEST(TaskOptions, ZerosAreTheDefaults) {
  const Task_Options options = zeroed();
  const auto sut = from_options("Fast", &options);
  ASSERT_TRUE(sut) << sut.error().message;
  auto changed = tasks();
  ASSERT_TRUE(apply_task_settings({&*sut, 1}, changed));
  EXPECT_EQ(changed[0].watchdog, TaskWatchdog{});
  EXPECT_EQ(changed[0].start_offset, 0ns);
  EXPECT_EQ(changed[0].late, LatePolicy::next);
  EXPECT_FALSE(changed[0].drives_outputs);
}

TEST(TaskOptions, ReachTheirTaskAndNoOther) {
  Task_Options options = zeroed();
  options.nStartOffsetNs = 2'500'000;
  options.nLatePolicy = PLC_LATE_ASAP;
  options.bDrivesOutputs = 1;
  options.dwWatchdogTimeUs = 4'000'000'000;
  options.dwWatchdogSensitivity = 3;
  options.dwWatchdogOmittedCycles = 9;
  options.nWatchdogPolicy = PLC_WATCHDOG_TASK;
  const auto sut = from_options("Slow", &options);
  ASSERT_TRUE(sut) << sut.error().message;
  auto changed = tasks();
  ASSERT_TRUE(apply_task_settings({&*sut, 1}, changed));
  EXPECT_EQ(changed[1].start_offset, 2500us);
  EXPECT_EQ(changed[1].late, LatePolicy::asap);
  EXPECT_TRUE(changed[1].drives_outputs);
  EXPECT_EQ(
      changed[1].watchdog,
      (TaskWatchdog{.time = 4000s, .sensitivity = 3, .omitted_cycles = 9, .policy = WatchdogPolicy::task}));
  EXPECT_EQ(changed[0].start_offset, 0ns);
  EXPECT_EQ(changed[0].watchdog, TaskWatchdog{});
}

TEST(TaskOptions, SettingsChangeOnlyWhatTheySay) {
  Task_Options options = zeroed();
  options.nLatePolicy = PLC_LATE_ASAP;
  options.dwWatchdogTimeUs = 700;
  auto changed = tasks();
  const auto own = from_options("Fast", &options);
  ASSERT_TRUE(apply_task_settings({&*own, 1}, changed));
  const TaskSettings settings{.task = "Fast", .where = "here", .watchdog_time = 900us};
  ASSERT_TRUE(apply_task_settings({&settings, 1}, changed));
  EXPECT_EQ(changed[0].late, LatePolicy::asap);
  EXPECT_EQ(changed[0].watchdog.time, 900us);
}

TEST(TaskOptions, UnknownTaskListsTheTasks) {
  const TaskSettings settings{.task = "Fats", .where = "line1.cfg:7: [Task.Fats]"};
  auto unchanged = tasks();
  const auto applied = apply_task_settings({&settings, 1}, unchanged);
  ASSERT_FALSE(applied);
  EXPECT_EQ(applied.error().message,
            "line1.cfg:7: [Task.Fats]: the application has no task 'Fats'; its tasks are Fast, Slow");
}

struct BadOption {
  void (*spoil)(Task_Options&);
  const char* complaint;
};

TEST(TaskOptions, ValuesThatAreNotAllowedAreNamed) {
  for (const auto& [spoil, complaint] : {
           BadOption{[](Task_Options& o) { o.dwSize = 12; },
                     "dwSize is 12: sizeof(Task_Options), 40, is allowed"},
           BadOption{[](Task_Options& o) { o.nStartOffsetNs = -1; }, "nStartOffsetNs is -1"},
           BadOption{[](Task_Options& o) { o.nLatePolicy = 2; }, "nLatePolicy is 2"},
           BadOption{[](Task_Options& o) { o.bDrivesOutputs = 2; }, "bDrivesOutputs is 2"},
           BadOption{[](Task_Options& o) { o.dwWatchdogSensitivity = 1'000'001; }, "dwWatchdogSensitivity"},
           BadOption{[](Task_Options& o) { o.dwWatchdogOmittedCycles = 1'000'001; },
                     "dwWatchdogOmittedCycles"},
           BadOption{[](Task_Options& o) { o.nWatchdogPolicy = -1; }, "nWatchdogPolicy is -1"},
       }) {
    Task_Options options = zeroed();
    spoil(options);
    const auto refused = from_options("Fast", &options);
    ASSERT_FALSE(refused) << complaint;
    EXPECT_THAT(refused.error().message, HasSubstr(complaint));
  }
  const Task_Options good = zeroed();
  EXPECT_FALSE(from_options(nullptr, &good));
  EXPECT_FALSE(from_options("Fast", nullptr));
  EXPECT_FALSE(from_options("a task", &good));
  EXPECT_FALSE(from_options(std::string(51, 'x').c_str(), &good));
}

}  // namespace
}  // namespace plchost
