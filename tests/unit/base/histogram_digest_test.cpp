#include "shm/base/histogram_digest.hpp"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace plchost {
namespace {

class Digest : public testing::TestWithParam<unsigned> {
 protected:
  void record(std::int64_t ns) {
    histogram_.record(Duration(ns));
    least_ = std::min(least_, ns);
    greatest_ = std::max(greatest_, ns);
  }
  [[nodiscard]] HistogramDigest digest() const { return {histogram_, Duration(least_), Duration(greatest_)}; }

  HistogramShape shape_{GetParam()};
  std::vector<std::atomic<std::uint32_t>> buckets_ =
      std::vector<std::atomic<std::uint32_t>>(shape_.bucket_count());
  DurationHistogram histogram_{shape_, buckets_};
  std::int64_t least_ = INT64_MAX;
  std::int64_t greatest_ = 0;
};

TEST_P(Digest, PercentilesAreThoseOfTheHistogram) {
  std::mt19937_64 random(3);
  std::lognormal_distribution<double> latencies(9.0, 2.0);
  for (int i = 0; i < 50'000; ++i) record(static_cast<std::int64_t>(latencies(random)));
  const HistogramDigest sut = digest();
  EXPECT_EQ(sut.total(), histogram_.total());
  for (std::size_t i = 0; i < HistogramDigest::kFractions.size(); ++i) {
    EXPECT_EQ(sut.percentiles()[i], histogram_.percentile(HistogramDigest::kFractions[i])) << i;
  }
}

TEST_P(Digest, BarsHoldEveryRecordAtItsPlace) {
  for (const std::int64_t ns : {0, 1, 15, 16, 17, 18, 1'000, 1'000'000, 1'023'999, 2'000'000'000}) record(ns);
  const HistogramDigest sut = digest();
  std::uint64_t sum = 0;
  for (const auto& bar : sut.bars()) {
    EXPECT_GT(bar.count, 0U);
    sum += bar.count;
  }
  EXPECT_EQ(sum, 10U);
  const auto count_at = [&](std::int64_t lower) {
    const auto found = std::ranges::find(sut.bars(), Duration(lower), &HistogramDigest::Bar::lower);
    return found == sut.bars().end() ? 0 : found->count;
  };
  EXPECT_EQ(count_at(15), 1U);
  EXPECT_EQ(count_at(16), 2U) << "two wide from 16 on";
  EXPECT_EQ(count_at(18), 1U);
  EXPECT_EQ(count_at(983'040), 2U) << "1,000,000 and 1,023,999: 15/16 of 2^20";
  EXPECT_TRUE(std::ranges::is_sorted(sut.bars(), {}, &HistogramDigest::Bar::lower));
}

TEST_P(Digest, APercentileIsNeverAboveTheGreatest) {
  for (int i = 0; i < 10; ++i) record(123'457);
  EXPECT_EQ(digest().percentiles().front(), Duration(123'457));
}

TEST_P(Digest, BeyondTheRangeTheGreatestIsTold) {
  for (int i = 0; i < 10; ++i) record(60'000'000'000);
  EXPECT_EQ(digest().total(), 10U);
  EXPECT_EQ(digest().percentiles().front(), Duration(60'000'000'000));
}

TEST_P(Digest, AboveTheLeastIsEachRecordLessTheLeast) {
  constexpr std::int64_t kLeast = 40'000;
  std::mt19937_64 random(5);
  std::lognormal_distribution<double> latencies(7.0, 1.0);
  std::vector<std::int64_t> above;
  record(kLeast);
  above.push_back(0);
  for (int i = 0; i < 20'000; ++i) {
    above.push_back(static_cast<std::int64_t>(latencies(random)));
    record(kLeast + above.back());
  }
  const HistogramDigest sut = digest().above_least(histogram_, Duration(least_), Duration(greatest_));
  std::ranges::sort(above);
  EXPECT_EQ(sut.total(), above.size());
  const double width = shape_.digits() == HistogramShape::kFine ? 0.001 : 0.008;
  for (std::size_t i = 0; i < HistogramDigest::kFractions.size(); ++i) {
    const auto exact =
        static_cast<double>(above[HistogramView::rank(HistogramDigest::kFractions[i], above.size()) - 1]);
    EXPECT_NEAR(static_cast<double>(sut.percentiles()[i].count()), exact, width * (kLeast + exact) + 1) << i;
  }
  std::uint64_t sum = 0;
  for (const auto& bar : sut.bars()) sum += bar.count;
  EXPECT_EQ(sum, sut.total());
  EXPECT_TRUE(std::ranges::is_sorted(sut.bars(), std::ranges::less(), &HistogramDigest::Bar::lower));
  EXPECT_GT(sut.bars().size(), 10U) << "40 us less, they do not lie in two bars";
}

TEST_P(Digest, AboveTheLeastOfNothingIsNothing) {
  const HistogramDigest empty(histogram_, Duration(0), Duration(0));
  const HistogramDigest sut = empty.above_least(histogram_, Duration(INT64_MIN), Duration(INT64_MAX));
  EXPECT_EQ(sut.total(), 0U);
  EXPECT_TRUE(sut.bars().empty());
}

TEST_P(Digest, AnEmptyOneHasNothing) {
  const HistogramDigest sut(histogram_, Duration(0), Duration(0));
  EXPECT_EQ(sut.total(), 0U);
  EXPECT_EQ(sut.percentiles().back(), Duration::zero());
  EXPECT_TRUE(sut.bars().empty());
}

TEST_P(Digest, HoldsAllBarsThereAre) {
  for (std::size_t i = 0; i < shape_.bucket_count(); ++i) record(shape_.lower_edge(i).count());
  EXPECT_EQ(digest().bars().size(), HistogramDigest::kMaxBars);
  EXPECT_EQ(digest().total(), shape_.bucket_count());
}

TEST_P(Digest, SurvivesALeastAndAGreatestThatCannotBe) {
  record(1'000);
  EXPECT_EQ(HistogramDigest(histogram_, Duration::max(), Duration::min()).total(), 0U);
  EXPECT_EQ(HistogramDigest(histogram_, Duration::min(), Duration::max()).total(), 1U);
}

INSTANTIATE_TEST_SUITE_P(Digits, Digest, testing::Values(HistogramShape::kCoarse, HistogramShape::kFine));

}  // namespace
}  // namespace plchost
