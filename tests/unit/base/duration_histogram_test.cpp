#include "shm/base/duration_histogram.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "shm/base/task_statistics.hpp"

namespace plchost {
namespace {

/// A histogram with its memory.
class Histogram : public DurationHistogram {
 public:
  explicit Histogram(unsigned digits) : Histogram(HistogramShape(digits)) {}

 private:
  struct Memory : std::vector<std::atomic<std::uint32_t>> {
    using vector::vector;
  };
  explicit Histogram(HistogramShape shape) : Histogram(shape, Memory(shape.bucket_count())) {}
  Histogram(HistogramShape shape, Memory memory)
      : DurationHistogram(shape, memory), memory_(std::move(memory)) {}
  Memory memory_;
};

class HistogramOf : public testing::TestWithParam<unsigned> {
 protected:
  [[nodiscard]] double promised_width() const { return GetParam() == HistogramShape::kFine ? 0.001 : 0.01; }
  HistogramShape shape_{GetParam()};
};

TEST_P(HistogramOf, EachBucketBeginsWhereTheOneBeforeEnds) {
  Duration expected{};
  for (std::size_t i = 0; i < shape_.bucket_count(); ++i) {
    ASSERT_EQ(shape_.lower_edge(i), expected) << i;
    EXPECT_EQ(shape_.index_of(shape_.lower_edge(i)), i);
    EXPECT_EQ(shape_.index_of(shape_.upper_edge(i)), i);
    expected = shape_.upper_edge(i) + Duration(1);
  }
  EXPECT_EQ(expected, Duration(std::int64_t{1} << 31)) << "up to two seconds and a little";
}

TEST_P(HistogramOf, NoValueOfABucketIsFurtherFromAnotherThanPromised) {
  for (std::size_t i = 1; i < shape_.bucket_count(); ++i) {
    const auto lower = static_cast<double>(shape_.lower_edge(i).count());
    const auto width = static_cast<double>((shape_.upper_edge(i) - shape_.lower_edge(i)).count());
    ASSERT_LE(width, promised_width() * lower) << i;
  }
}

TEST_P(HistogramOf, IsExactUpToTwiceItsBucketsPerOctave) {
  const std::int64_t linear = GetParam() == HistogramShape::kFine ? 2048 : 256;
  EXPECT_EQ(shape_.upper_edge(static_cast<std::size_t>(linear - 1)), Duration(linear - 1));
  EXPECT_EQ(shape_.upper_edge(static_cast<std::size_t>(linear)), Duration(linear + 1));
}

TEST_P(HistogramOf, AnyValueComesBackWithinTheErrorPromised) {
  std::mt19937_64 random(GetParam());
  for (int i = 0; i < 200'000; ++i) {
    // Each order of magnitude as often as the others.
    const std::int64_t ns = static_cast<std::int64_t>(random() >> 33) >> (random() % 31);
    const Duration told = shape_.upper_edge(shape_.index_of(Duration(ns)));
    ASSERT_GE(told.count(), ns);
    ASSERT_LE(static_cast<double>(told.count() - ns), promised_width() * static_cast<double>(ns));
  }
}

TEST_P(HistogramOf, ValuesBeyondTheRangeLieAtItsEnds) {
  EXPECT_EQ(shape_.index_of(Duration(-5)), 0U);
  EXPECT_EQ(shape_.index_of(Duration::min()), 0U);
  EXPECT_EQ(shape_.index_of(Duration(std::int64_t{1} << 31)), shape_.bucket_count() - 1);
  EXPECT_EQ(shape_.index_of(Duration::max()), shape_.bucket_count() - 1);
}

TEST_P(HistogramOf, AnEmptyOneHasPercentileZero) {
  const Histogram sut(GetParam());
  EXPECT_EQ(sut.total(), 0U);
  EXPECT_EQ(sut.percentile(0.99), Duration::zero());
}

TEST_P(HistogramOf, PercentilesAreThoseOfTheSortedListWithinTheErrorPromised) {
  std::mt19937_64 random(7);
  std::lognormal_distribution<double> latencies(9.0, 2.0);
  for (const std::size_t count : {1U, 2U, 3U, 99U, 10'000U}) {
    Histogram sut(GetParam());
    std::vector<std::int64_t> sorted;
    for (std::size_t i = 0; i < count; ++i) {
      sorted.push_back(std::min(static_cast<std::int64_t>(latencies(random)), std::int64_t{2'000'000'000}));
      sut.record(Duration(sorted.back()));
    }
    std::ranges::sort(sorted);
    EXPECT_EQ(sut.total(), count);
    for (const double fraction : {0.0, 0.001, 0.5, 0.9, 0.99, 0.999, 0.9999, 1.0}) {
      const std::int64_t exact = sorted[HistogramView::rank(fraction, count) - 1];
      const std::int64_t told = sut.percentile(fraction).count();
      EXPECT_GE(told, exact) << fraction;
      EXPECT_LE(static_cast<double>(told - exact), promised_width() * static_cast<double>(exact)) << fraction;
    }
  }
}

TEST_P(HistogramOf, AFullBucketStaysFull) {
  std::vector<std::atomic<std::uint32_t>> buckets(shape_.bucket_count());
  DurationHistogram sut(shape_, buckets);
  buckets[5] = std::numeric_limits<std::uint32_t>::max() - 1;
  for (int i = 0; i < 3; ++i) sut.record(Duration(5));
  EXPECT_EQ(sut.count(5), std::numeric_limits<std::uint32_t>::max());
}

TEST_P(HistogramOf, ClearForgetsAll) {
  Histogram sut(GetParam());
  for (const std::int64_t ns : {0, 1, 5'000, 999'999'999}) sut.record(Duration(ns));
  sut.clear();
  EXPECT_EQ(sut.total(), 0U);
}

INSTANTIATE_TEST_SUITE_P(Digits, HistogramOf,
                         testing::Values(HistogramShape::kCoarse, HistogramShape::kFine));

TEST(HistogramRank, IsTheWholeListAtOneAndTheFirstAtZero) {
  EXPECT_EQ(HistogramView::rank(0.0, 10), 1U);
  EXPECT_EQ(HistogramView::rank(0.5, 3), 2U) << "rounded up";
  EXPECT_EQ(HistogramView::rank(1.0, 10), 10U);
  EXPECT_EQ(HistogramView::rank(7.0, 10), 10U);
}

TEST(TaskStatisticsMemory, ItsHistogramsShareNoBucket) {
  for (const unsigned digits : {HistogramShape::kCoarse, HistogramShape::kFine}) {
    TaskStatistics sut(digits);
    for (std::size_t i = 0; i < kTaskHistograms; ++i) {
      sut.histograms[i].record(i % 2 == 0 ? Duration::max() : Duration(0));  // beside each other's
    }
    for (const DurationHistogram& one : sut.histograms) {
      EXPECT_EQ(one.total(), 1U);
      EXPECT_EQ(one.shape().digits(), digits);
    }
  }
}

}  // namespace
}  // namespace plchost
