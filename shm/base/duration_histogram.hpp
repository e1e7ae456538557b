#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "shm/base/time.hpp"

namespace plchost {

/// Which duration lies in which bucket: HdrHistogram's geometry, at 1 ns. With 3 significant digits linear
/// below 2048 ns and then 1024 buckets per octave: all values of a bucket are the same within 0.1 %. With 2
/// digits linear below 256 ns, then 128: within 0.8 %. Up to 2^31 - 1 ns (2.1 s); longer ones lie in the last
/// bucket. Pure.
class HistogramShape {
 public:
  static constexpr unsigned kCoarse = 2;
  static constexpr unsigned kFine = 3;

  [[nodiscard]] static constexpr bool is_valid(std::uint64_t digits) noexcept {
    return digits == kCoarse || digits == kFine;
  }
  /// `digits`: kCoarse or kFine.
  explicit constexpr HistogramShape(unsigned digits) noexcept
      : HistogramShape(digits, digits == kFine ? 10 : 7) {}
  /// The same geometry with 8 buckets per octave, to draw from: no bucket of the others lies in two of its.
  [[nodiscard]] static constexpr HistogramShape bars() noexcept { return {1, 3}; }

  [[nodiscard]] constexpr unsigned digits() const noexcept { return digits_; }
  [[nodiscard]] constexpr std::size_t bucket_count() const noexcept {
    return std::size_t{kMaxBits + 1 - sub_bits_} << sub_bits_;
  }
  /// Below zero counts as zero.
  [[nodiscard]] constexpr std::size_t index_of(Duration value) const noexcept {
    const auto clipped = static_cast<std::uint64_t>(std::max<Duration::rep>(value.count(), 0));
    const std::uint64_t ns = std::min(clipped, (std::uint64_t{1} << kMaxBits) - 1);
    const auto bits = static_cast<unsigned>(std::bit_width(ns));
    const unsigned shift = std::max(bits, sub_bits_ + 1) - (sub_bits_ + 1);
    return (std::size_t{shift} << sub_bits_) + (ns >> shift);
  }
  /// The least duration of bucket `index`; of bucket_count(): the first beyond all.
  [[nodiscard]] constexpr Duration lower_edge(std::size_t index) const noexcept {
    const std::size_t shift = std::max<std::size_t>(index >> sub_bits_, 1) - 1;
    return Duration(static_cast<Duration::rep>((index - (shift << sub_bits_)) << shift));
  }
  /// The greatest duration of bucket `index`.
  [[nodiscard]] constexpr Duration upper_edge(std::size_t index) const noexcept {
    return lower_edge(index + 1) - Duration(1);
  }

 private:
  constexpr HistogramShape(unsigned digits, unsigned sub_bits) noexcept
      : digits_(digits), sub_bits_(sub_bits) {}
  static constexpr unsigned kMaxBits = 31;
  unsigned digits_;
  unsigned sub_bits_;  // buckets per octave, as a power of two
};

using HistogramBuckets = std::span<std::atomic<std::uint32_t>>;
using ConstHistogramBuckets = std::span<const std::atomic<std::uint32_t>>;

/// A histogram as its readers see it, while it is written or not. Refers to the buckets, wherever they lie.
class HistogramView {
 public:
  /// `buckets`: shape.bucket_count() of them.
  HistogramView(HistogramShape shape, ConstHistogramBuckets buckets) noexcept
      : shape_(shape), buckets_(buckets) {
    assert(buckets.size() == shape.bucket_count());
  }

  [[nodiscard]] const HistogramShape& shape() const noexcept { return shape_; }
  /// `index` < shape().bucket_count().
  [[nodiscard]] std::uint32_t count(std::size_t index) const noexcept {
    return buckets_[index].load(std::memory_order_relaxed);
  }

  [[nodiscard]] std::uint64_t total() const noexcept {
    std::uint64_t sum = 0;
    for (const auto& bucket : buckets_) sum += bucket.load(std::memory_order_relaxed);
    return sum;
  }

  /// The value that a share `fraction` (0 to 1) of all records is not above; the upper edge of its bucket.
  [[nodiscard]] Duration percentile(double fraction) const noexcept {
    const std::uint64_t all = total();
    if (all == 0) return Duration::zero();
    const std::uint64_t wanted = rank(fraction, all);
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < buckets_.size(); ++i) {
      sum += count(i);
      if (sum >= wanted) return shape_.upper_edge(i);
    }
    return shape_.upper_edge(buckets_.size() - 1);
  }

  /// The how manieth of `total` sorted records is the percentile `fraction`: from 1, rounded up.
  [[nodiscard]] static std::uint64_t rank(double fraction, std::uint64_t total) noexcept {
    const double share = std::ceil(std::clamp(fraction, 0.0, 1.0) * static_cast<double>(total));
    return std::max<std::uint64_t>(1, static_cast<std::uint64_t>(share));
  }

 private:
  HistogramShape shape_;
  ConstHistogramBuckets buckets_;
};

/// The writer's end. One thread at a time.
class DurationHistogram : public HistogramView {
 public:
  /// `buckets`: shape.bucket_count() of them, zero or as a writer before left them.
  DurationHistogram(HistogramShape shape, HistogramBuckets buckets) noexcept
      : HistogramView(shape, buckets), buckets_(buckets) {}

  /// Real-time. A full bucket stays full.
  void record(Duration value) noexcept {
    auto& bucket = buckets_[shape().index_of(value)];
    const std::uint32_t before = bucket.load(std::memory_order_relaxed);
    constexpr std::uint32_t kFull = std::numeric_limits<std::uint32_t>::max();
    bucket.store(before + (before == kFull ? 0 : 1), std::memory_order_relaxed);
  }

  void clear() noexcept {
    for (auto& bucket : buckets_) {
      // Untouched memory stays clean: only what was counted is written to.
      if (bucket.load(std::memory_order_relaxed) != 0) bucket.store(0, std::memory_order_relaxed);
    }
  }

 private:
  HistogramBuckets buckets_;
};

}  // namespace plchost
