#include "shm/base/histogram_digest.hpp"

#include <algorithm>

#include "shm/base/wrapping.hpp"

namespace plchost {

namespace {

constexpr HistogramShape kBars = HistogramShape::bars();

/// The buckets of a histogram that lie in one bar.
struct Buckets {
  std::size_t begin;
  std::size_t end;
};

Buckets buckets_of(const HistogramShape& shape, std::size_t bar) noexcept {
  const bool is_last = bar + 1 == kBars.bucket_count();
  return {shape.index_of(kBars.lower_edge(bar)),
          is_last ? shape.bucket_count() : shape.index_of(kBars.lower_edge(bar + 1))};
}

}  // namespace

HistogramDigest::HistogramDigest(const HistogramView& histogram, Duration least, Duration greatest) noexcept {
  const std::size_t last = kBars.index_of(greatest);
  for (std::size_t bar = kBars.index_of(least); bar <= last; ++bar) {
    std::uint64_t count = 0;
    const auto [begin, end] = buckets_of(histogram.shape(), bar);
    for (std::size_t i = begin; i < end; ++i) count += histogram.count(i);
    if (count == 0) continue;
    total_ += count;
    bars_[bar_count_++] = {.lower = kBars.lower_edge(bar), .count = count};
  }
  for (std::size_t i = 0; i < kFractions.size(); ++i) {
    percentiles_[i] = percentile(histogram, kFractions[i], greatest);
  }
}

// Buckets that are moved lie across bars, so each is taken as its greatest duration, as percentiles are.
HistogramDigest HistogramDigest::above_least(const HistogramView& histogram, Duration least,
                                             Duration greatest) const noexcept {
  HistogramDigest above;
  const HistogramShape& shape = histogram.shape();
  const auto moved = [&](Duration value) {
    return Duration(std::max<Duration::rep>(wrapping_difference(value.count(), least.count()), 0));
  };
  const std::size_t last = shape.index_of(greatest);
  for (std::size_t i = shape.index_of(least); i <= last; ++i) {
    const std::uint64_t count = histogram.count(i);
    if (count == 0) continue;
    const Duration lower = kBars.lower_edge(kBars.index_of(moved(std::min(shape.upper_edge(i), greatest))));
    if (above.bar_count_ == 0 || above.bars_[above.bar_count_ - 1].lower != lower)
      above.bars_[above.bar_count_++] = {.lower = lower, .count = 0};
    above.bars_[above.bar_count_ - 1].count += count;
    above.total_ += count;
  }
  if (above.total_ > 0) std::ranges::transform(percentiles_, above.percentiles_.begin(), moved);
  return above;
}

Duration HistogramDigest::percentile(const HistogramView& histogram, double fraction,
                                     Duration greatest) const noexcept {
  if (total_ == 0) return Duration::zero();
  const HistogramShape& shape = histogram.shape();
  const std::uint64_t wanted = HistogramView::rank(fraction, total_);
  std::uint64_t sum = 0;
  for (const Bar& bar : bars()) {
    if (sum + bar.count < wanted) {
      sum += bar.count;
      continue;
    }
    const auto [begin, end] = buckets_of(shape, kBars.index_of(bar.lower));
    for (std::size_t i = begin; i < end; ++i) {
      sum += histogram.count(i);
      if (sum < wanted) continue;
      return i + 1 == shape.bucket_count() ? greatest : std::min(shape.upper_edge(i), greatest);
    }
    break;  // it was cleared since it was counted
  }
  return greatest;
}

}  // namespace plchost
