#include "api/server/heap_trim.hpp"

#include <chrono>

#include <gtest/gtest.h>

namespace plchost {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint kBegin{Duration(1h)};

TEST(HeapTrim, WaitsUntilThereWasEnoughWorkAndNothingGoesOn) {
  HeapTrim sut;
  sut.worked(HeapTrim::kWorth - 1, kBegin);
  EXPECT_FALSE(sut.look(kBegin + 1h));
  sut.worked(1, kBegin + 2h);
  EXPECT_FALSE(sut.look(kBegin + 2h + HeapTrim::kQuiet - 1ms));
  EXPECT_TRUE(sut.look(kBegin + 2h + HeapTrim::kQuiet));
}

TEST(HeapTrim, IsDoneOnceForTheSameWork) {
  HeapTrim sut;
  sut.worked(HeapTrim::kWorth, kBegin);
  ASSERT_TRUE(sut.look(kBegin + 1h));
  sut.worked(HeapTrim::kWorth - 1, kBegin + 1h);
  EXPECT_FALSE(sut.look(kBegin + 2h));
  sut.worked(1, kBegin + 2h);
  EXPECT_TRUE(sut.look(kBegin + 3h));
}

TEST(HeapTrim, IsNotPutOffByWorkOfNobody) {
  HeapTrim sut;
  sut.worked(HeapTrim::kWorth, kBegin);
  sut.worked(0, kBegin + 1h);
  EXPECT_TRUE(sut.look(kBegin + 1h));
}

}  // namespace
}  // namespace plchost
