#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "shm/base/duration_histogram.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// A histogram for readers that cannot see it: percentiles, and 8 bars per octave to draw.
class HistogramDigest {
 public:
  static constexpr std::array kFractions{0.5, 0.9, 0.99, 0.999, 0.9999};
  static constexpr std::size_t kMaxBars = HistogramShape::bars().bucket_count();

  struct Bar {
    Duration lower{};         ///< its least duration; the greatest is just below the next edge of bars()
    std::uint64_t count = 0;  ///< > 0
  };

  /// Reads the buckets between the durations `least` and `greatest`, those recorded, and no others: that is
  /// what it costs. Values out of order or range do no harm.
  HistogramDigest(const HistogramView& histogram, Duration least, Duration greatest) noexcept;

  /// The same records less `least`. *this is the digest of `histogram`, made with these bounds.
  [[nodiscard]] HistogramDigest above_least(const HistogramView& histogram, Duration least,
                                            Duration greatest) const noexcept;

  [[nodiscard]] std::uint64_t total() const noexcept { return total_; }
  /// By kFractions. Never above `greatest`, and just that where only the last bucket is known. 0 if total()
  /// is.
  [[nodiscard]] const std::array<Duration, kFractions.size()>& percentiles() const noexcept {
    return percentiles_;
  }
  /// In order; empty ones are left out.
  [[nodiscard]] std::span<const Bar> bars() const noexcept { return std::span(bars_).first(bar_count_); }

 private:
  HistogramDigest() = default;
  [[nodiscard]] Duration percentile(const HistogramView& histogram, double fraction,
                                    Duration greatest) const noexcept;

  std::uint64_t total_ = 0;
  std::array<Duration, kFractions.size()> percentiles_{};
  std::array<Bar, kMaxBars> bars_{};
  std::size_t bar_count_ = 0;
};

}  // namespace plchost
