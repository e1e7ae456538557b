#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "schedulers/scheduler.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

TEST(Registry, KnowsTheThreeSchedulers) {
  EXPECT_EQ(scheduler_names(), "CmpSchedule, CmpScheduleTimer, CmpScheduleOneShot");
}

TEST(Registry, UnknownNameListsTheKnown) {
  const auto found = find_scheduler("CmpSchedul");
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::invalid_argument);
  EXPECT_THAT(found.error().message, testing::HasSubstr("'CmpSchedul'"));
  EXPECT_THAT(found.error().message, testing::HasSubstr(scheduler_names()));
}

TEST(Registry, OnlyCmpScheduleOffersBreakpointsInExternalEventTasksAndOnlyOneShotMovesReleases) {
  LinuxClock clock;
  for (const SchedulerEntry& entry : all_schedulers()) {
    const auto scheduler = entry.make({.clock = clock, .settings = {}});
    EXPECT_EQ(scheduler->name(), entry.name);
    EXPECT_EQ(scheduler->capabilities().external_event_breakpoints, entry.name == "CmpSchedule");
    EXPECT_EQ(scheduler->capabilities().one_shot, entry.name == "CmpScheduleOneShot");
  }
}

struct Setting {
  const char* name;
  void (*spoil)(SchedulerSettings&);
};

class Settings : public testing::TestWithParam<Setting> {};

TEST_P(Settings, OutOfRangeIsRefusedByName) {
  SchedulerSettings settings;
  ASSERT_TRUE(check_settings(settings));
  GetParam().spoil(settings);
  const auto checked = check_settings(settings);
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().code, ErrorCode::invalid_argument);
  EXPECT_THAT(checked.error().message, testing::HasSubstr(GetParam().name));
}

INSTANTIATE_TEST_SUITE_P(
    Each, Settings,
    testing::Values(
        Setting{"scheduler_interval", [](SchedulerSettings& s) { s.scheduler_interval = Duration::zero(); }},
        Setting{"scheduler_interval",
                [](SchedulerSettings& s) { s.scheduler_interval = kMaxInterval + Duration(1); }},
        Setting{"freewheeling_cycletime",
                [](SchedulerSettings& s) { s.freewheeling_cycletime = Duration(-1); }},
        Setting{"freewheeling_cycletime",
                [](SchedulerSettings& s) { s.freewheeling_cycletime = kMaxInterval + Duration(1); }},
        Setting{"processor_load_maximum", [](SchedulerSettings& s) { s.processor_load_maximum = -1; }},
        Setting{"processor_load_maximum", [](SchedulerSettings& s) { s.processor_load_maximum = 101; }},
        Setting{"spin_ahead_max", [](SchedulerSettings& s) { s.spin_ahead_max = Duration(-1); }},
        Setting{"spin_ahead_max",
                [](SchedulerSettings& s) { s.spin_ahead_max = kMaxSpinAhead + Duration(1); }},
        Setting{"max_event_backlog", [](SchedulerSettings& s) { s.max_event_backlog = 0; }}));

}  // namespace
}  // namespace plchost
