#include "api/client/late_writers.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace plchost {
namespace {

using Writers = std::vector<dds_instance_handle_t>;

constexpr TimePoint kFirstSeen{std::chrono::seconds(1000)};
constexpr Duration kLateBy = std::chrono::milliseconds(700);

TEST(LateWriters, AreNotWaitedForIfThereIsNone) {
  LateWriters sut;
  EXPECT_LT(sut.until(Writers{}, kFirstSeen), kFirstSeen);
}

TEST(LateWriters, AreWaitedForFromWhenTheyWereSeenFirst) {
  LateWriters sut;
  EXPECT_EQ(sut.until(Writers{7}, kFirstSeen), kFirstSeen + LateWriters::kPatience);
  EXPECT_EQ(sut.until(Writers{7}, kFirstSeen + kLateBy), kFirstSeen + LateWriters::kPatience);
  EXPECT_EQ(sut.until(Writers{7}, kFirstSeen + 2 * LateWriters::kPatience),
            kFirstSeen + LateWriters::kPatience)
      << "one that stands still holds up one call only";
}

TEST(LateWriters, AreWaitedForUntilTheLastOfThem) {
  LateWriters sut;
  (void)sut.until(Writers{7}, kFirstSeen);
  EXPECT_EQ(sut.until(Writers{7, 8}, kFirstSeen + kLateBy), kFirstSeen + kLateBy + LateWriters::kPatience);
  EXPECT_EQ(sut.until(Writers{7}, kFirstSeen + 2 * kLateBy), kFirstSeen + LateWriters::kPatience);
}

TEST(LateWriters, ThatWereNotLateMeanwhileBeginAnew) {
  LateWriters sut;
  (void)sut.until(Writers{7}, kFirstSeen);
  (void)sut.until(Writers{}, kFirstSeen + kLateBy);
  EXPECT_EQ(sut.until(Writers{7}, kFirstSeen + 2 * kLateBy),
            kFirstSeen + 2 * kLateBy + LateWriters::kPatience);
}

}  // namespace
}  // namespace plchost
