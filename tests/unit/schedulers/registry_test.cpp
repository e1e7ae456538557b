#include "schedulers/policies/registry.hpp"

#include <string>
#include <tuple>
#include <type_traits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "schedulers/activation/scheduler.hpp"
#include "schedulers/tasks/task_kind.hpp"
#include "shm/base/names.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;

TEST(Registry, KnowsTheThreeSchedulers) {
  EXPECT_EQ(scheduler_names(), "CmpSchedule, CmpScheduleTimer, CmpScheduleOneShot");
}

TEST(Registry, NamesFitIntoTheStatusOfAHost) {
  std::size_t length = 0;
  for (const std::string_view name : kSchedulerNames) length += name.size() + 1;
  EXPECT_LE(length - 1, kMaxSchedulerList);
}

TEST(TaskKinds, EachHasItsOwnWays) {
  for (const TaskKindTraits& kind : kTaskKinds) {
    const TaskKindEntry* const entry = find_task_kind(kind.kind);
    ASSERT_NE(entry, nullptr) << kind.name;
    EXPECT_EQ(entry->kind, kind.kind);
    EXPECT_NE(entry->check, nullptr);
  }
  EXPECT_EQ(find_task_kind(TaskKind{99}), nullptr);
}

TEST(Registry, UnknownNameListsTheKnown) {
  const auto found = find_scheduler("CmpSchedul");
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::invalid_argument);
  EXPECT_THAT(found.error().message, testing::HasSubstr("'CmpSchedul'"));
  EXPECT_THAT(found.error().message, testing::HasSubstr(scheduler_names()));
}

TEST(Registry, EachSchedulerHasItsNameAndItsCapabilities) {
  LinuxClock clock;
  for (const SchedulerEntry& entry : all_schedulers()) {
    const auto scheduler = entry.make({.clock = clock, .settings = {}});
    EXPECT_LE(entry.name.size(), kMaxSchedulerName);
    EXPECT_EQ(scheduler->name(), entry.name);
    EXPECT_EQ(scheduler->capabilities().one_shot, entry.name == "CmpScheduleOneShot");
    if (entry.name == "CmpSchedule") {
      EXPECT_TRUE(entry.halts_external_tasks);
    }
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

/// The result of the check when the setting of that row has this value.
template <auto... kPath, class Value>
Result<void> checked_with(const SettingRange<kPath...>& /*row*/, Value value) {
  SchedulerSettings settings;
  (settings.*....*kPath) = value;
  return check_settings(settings);
}

TEST(SettingRanges, HoldForEachRowOfTheTable) {
  const auto hold = [](const auto& row) {
    SCOPED_TRACE(row.name);
    using Value = typename std::remove_cvref_t<decltype(row)>::Value;
    const auto [lowest, highest] = row.in_programs;
    EXPECT_TRUE(checked_with(row, lowest));
    EXPECT_TRUE(checked_with(row, highest));
    EXPECT_TRUE(lowest <= row.in_files.lowest && row.in_files.highest <= highest);
    for (const Value outside : {lowest - Value(1), highest + Value(1)}) {
      const auto checked = checked_with(row, outside);
      ASSERT_FALSE(checked);
      EXPECT_THAT(checked.error().message, testing::HasSubstr(std::string(row.name)));
    }
  };
  std::apply([&](const auto&... row) { (hold(row), ...); }, kSettingRanges);
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
                [](SchedulerSettings& s) { s.spin_ahead_max = std::chrono::milliseconds(1) + Duration(1); }},
        Setting{"max_event_backlog", [](SchedulerSettings& s) { s.max_event_backlog = 0; }}));

}  // namespace
}  // namespace plchost
