#include "schedulers/tasks/freewheel_rule.hpp"

#include <gtest/gtest.h>

namespace plchost {
namespace {

using std::chrono::milliseconds;

TEST(FreewheelRule, SleepsAFifthOfTheExecutionTimeByDefault) {
  EXPECT_EQ(FreewheelRule({}).sleep_after(milliseconds(10)), milliseconds(2));
}

TEST(FreewheelRule, SleepsWhatTheProcessorLoadMaximumLeaves) {
  SchedulerSettings settings;
  settings.processor_load_maximum = 60;
  EXPECT_EQ(FreewheelRule(settings).sleep_after(milliseconds(10)), milliseconds(4));
}

TEST(FreewheelRule, SleepsTheFixedTimeIfOneIsSet) {
  SchedulerSettings settings;
  settings.processor_load_maximum = 60;
  settings.freewheeling_cycletime = milliseconds(10);
  EXPECT_EQ(FreewheelRule(settings).sleep_after(milliseconds(500)), milliseconds(10));
  EXPECT_EQ(FreewheelRule(settings).sleep_after(Duration::zero()), milliseconds(10));
}

TEST(FreewheelRule, LetsGoOfTheProcessorEvenAfterAnEmptyCycle) {
  EXPECT_EQ(FreewheelRule({}).sleep_after(Duration::zero()), FreewheelRule::kShortest);
}

}  // namespace
}  // namespace plchost
