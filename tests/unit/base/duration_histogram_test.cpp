#include <memory>

#include <gtest/gtest.h>

#include "shm/base/task_statistics.hpp"

namespace plchost {
namespace {

TEST(DurationHistogram, EachValueLiesInItsBucketAndNotBelow) {
  for (unsigned bit = 0; bit < DurationHistogram::kMaxBits; ++bit) {
    for (const std::int64_t offset : {-1, 0, 1}) {
      const Duration value((std::int64_t{1} << bit) + offset);
      const std::size_t index = DurationHistogram::index_of(value);
      ASSERT_LT(index, DurationHistogram::kBuckets);
      EXPECT_LE(value, DurationHistogram::upper_edge(index)) << value.count();
      if (index > 0) {
        EXPECT_GT(value, DurationHistogram::upper_edge(index - 1)) << value.count();
      }
    }
  }
}

TEST(DurationHistogram, EachUpperEdgeIsTheLastValueOfItsBucket) {
  for (std::size_t i = 0; i < DurationHistogram::kBuckets; ++i) {
    const Duration edge = DurationHistogram::upper_edge(i);
    EXPECT_EQ(DurationHistogram::index_of(edge), i);
    if (i + 1 < DurationHistogram::kBuckets) {
      EXPECT_EQ(DurationHistogram::index_of(edge + Duration(1)), i + 1);
    }
  }
}

TEST(DurationHistogram, IsAtMostOnePartIn32Wide) {
  for (const std::int64_t ns : {100, 12'345, 999'999, 87'654'321}) {
    const Duration edge = DurationHistogram::upper_edge(DurationHistogram::index_of(Duration(ns)));
    EXPECT_LE(edge.count() - ns, ns / 32 + 1);
  }
}

TEST(DurationHistogram, PutsValuesBeyondTheRangeAtItsEnds) {
  EXPECT_EQ(DurationHistogram::index_of(Duration(-5)), 0U);
  EXPECT_EQ(DurationHistogram::index_of(Duration::max()), DurationHistogram::kBuckets - 1);
}

TEST(DurationHistogram, AnEmptyOneHasPercentileZero) {
  const auto sut = std::make_unique<DurationHistogram>();
  EXPECT_EQ(sut->total(), 0U);
  EXPECT_EQ(sut->percentile(0.99), Duration::zero());
}

TEST(DurationHistogram, PercentileIsNotBelowTheShareOfRecords) {
  const auto sut = std::make_unique<DurationHistogram>();
  for (int i = 1; i <= 100; ++i) sut->record(Duration(i <= 99 ? 10 : 1'000'000));
  EXPECT_EQ(sut->total(), 100U);
  EXPECT_EQ(sut->percentile(0.0), Duration(10));
  EXPECT_EQ(sut->percentile(0.5), Duration(10));
  EXPECT_EQ(sut->percentile(0.99), Duration(10));
  EXPECT_GE(sut->percentile(0.991), Duration(1'000'000));
  EXPECT_GE(sut->percentile(1.0), Duration(1'000'000));
}

TEST(DurationHistogram, PercentileOfFewRecordsRoundsUp) {
  const auto sut = std::make_unique<DurationHistogram>();
  for (const int ns : {1, 2, 3}) sut->record(Duration(ns));
  EXPECT_EQ(sut->percentile(0.5), Duration(2));
}

}  // namespace
}  // namespace plchost
