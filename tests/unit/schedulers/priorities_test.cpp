#include "schedulers/tasks/priorities.hpp"

#include <gtest/gtest.h>

namespace plchost {
namespace {

struct Band {
  PriorityBand band;
  int supervision;
};

class Priorities : public testing::TestWithParam<Band> {};

TEST_P(Priorities, FollowTheTableOfTheBand) {
  const auto [band, supervision] = GetParam();
  EXPECT_EQ(supervision_priority(band).fifo, supervision);
  EXPECT_EQ(tick_priority(band).fifo, supervision - 1);
  EXPECT_EQ(task_priority(band, 0).fifo, supervision - 2);
  EXPECT_EQ(task_priority(band, 15).fifo, supervision - 17);
  EXPECT_EQ(switch_priority(band).fifo, supervision - 18);
}

TEST_P(Priorities, FallWithTheIecNumber) {
  const PriorityBand band = GetParam().band;
  for (int i = 1; i <= kLowestRealTimeIecPriority; ++i) {
    EXPECT_LT(task_priority(band, i).fifo, task_priority(band, i - 1).fifo);
  }
}

TEST_P(Priorities, Below15AreNiceValuesWithoutRealTime) {
  const PriorityBand band = GetParam().band;
  for (int i = kLowestRealTimeIecPriority + 1; i <= kLowestIecPriority; ++i) {
    EXPECT_EQ(task_priority(band, i).fifo, 0);
    EXPECT_EQ(task_priority(band, i).nice, i - 16);
  }
}

INSTANTIATE_TEST_SUITE_P(Bands, Priorities,
                         testing::Values(Band{PriorityBand::high, 89}, Band{PriorityBand::normal, 69},
                                         Band{PriorityBand::low, 49}),
                         [](const auto& band) {
                           return std::string(band.param.supervision == 89   ? "high"
                                              : band.param.supervision == 69 ? "normal"
                                                                             : "low");
                         });

}  // namespace
}  // namespace plchost
