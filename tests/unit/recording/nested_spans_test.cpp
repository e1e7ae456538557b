// Spans of the tasks of one core as begins and ends that nest.
#include "api/recording/nested_spans.hpp"

#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace plchost {
namespace {

using testing::ElementsAre;

/// "1+0 5-0": span 0 begins at 1 and ends at 5; "5*1": span 1 begins again.
std::vector<std::string> steps_of(const std::vector<TimeSpan>& spans) {
  std::vector<std::string> lines;
  for (const NestedStep& step : nested(spans))
    lines.push_back(fmt::format("{}{}{}", step.time, step.again ? "*" : step.begins ? "+" : "-", step.span));
  return lines;
}

TEST(SpansOfACore, OneAfterTheOtherDoNotTouch) {
  EXPECT_THAT(steps_of({{1, 5, 0}, {5, 7, 1}}), ElementsAre("1+0", "5-0", "5+1", "7-1"));
}

TEST(SpansOfACore, OfATaskThatPreEmptsLiesWithinTheOther) {
  EXPECT_THAT(steps_of({{3, 4, 1}, {1, 9, 0}}), ElementsAre("1+1", "3+0", "4-0", "9-1"));
}

TEST(SpansOfACore, ThatWouldCrossAreCutWhereTheLowerOneEnds) {
  EXPECT_THAT(steps_of({{1, 5, 0}, {3, 9, 1}}), ElementsAre("1+0", "3+1", "5-1", "5-0", "5*1", "9-1"));
}

TEST(SpansOfACore, WithoutLengthAndOfOneTimeNest) {
  EXPECT_THAT(steps_of({{2, 2, 0}, {2, 6, 1}, {2, 6, 2}}),
              ElementsAre("2+1", "2+2", "2+0", "2-0", "6-2", "6-1"));
}

TEST(SpansOfACore, OfAnyKindNest) {
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    std::vector<TimeSpan> spans;
    for (std::size_t i = 0; i < 40; ++i) {
      const auto from = static_cast<std::int64_t>(random() % 50);
      spans.push_back({from, from + static_cast<std::int64_t>(random() % 10), i});
    }
    std::vector<std::size_t> open;
    std::vector<std::int64_t> had(spans.size());
    std::int64_t last = 0;
    for (const NestedStep& step : nested(spans)) {
      ASSERT_GE(step.time, last);
      last = step.time;
      if (step.begins) {
        open.push_back(step.span);
        had[step.span] -= step.time;
      } else {
        ASSERT_EQ(open.back(), step.span);
        open.pop_back();
        had[step.span] += step.time;
      }
    }
    ASSERT_TRUE(open.empty());
    for (const TimeSpan& span : spans) ASSERT_EQ(had[span.who], span.to - span.from);
  }
}

}  // namespace
}  // namespace plchost
