#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "shm/base/time.hpp"

namespace plchost::bench {

/// Figures of one kind, most of them latencies. Reserve before measuring: add() then allocates nothing.
class Samples {
 public:
  Samples() = default;
  explicit Samples(std::size_t capacity) { values_.reserve(capacity); }
  /// A cycle never allocates: of values that do not fit, only the number and the greatest one are kept.
  void add(Duration value) noexcept {
    if (values_.size() < values_.capacity())
      values_.push_back(value);
    else
      drop(1, value);
  }
  /// For figures that are computed after measuring.
  void push(Duration value) { values_.push_back(value); }
  void append(const Samples& other) {
    values_.insert(values_.end(), other.values_.begin(), other.values_.end());
    drop(other.dropped_, other.greatest_dropped_);
  }
  /// Values that did not fit. They are in no percentile.
  [[nodiscard]] std::size_t dropped() const noexcept { return dropped_; }
  /// Of those that did not fit; Duration::min() if all did.
  [[nodiscard]] Duration greatest_dropped() const noexcept { return greatest_dropped_; }
  [[nodiscard]] std::size_t size() const noexcept { return values_.size(); }
  [[nodiscard]] const std::vector<Duration>& values() const noexcept { return values_; }

 private:
  void drop(std::size_t count, Duration greatest) noexcept {
    dropped_ += count;
    greatest_dropped_ = std::max(greatest_dropped_, greatest);
  }

  std::vector<Duration> values_;
  std::size_t dropped_ = 0;
  Duration greatest_dropped_ = Duration::min();
};

/// A figure that could not be measured, or says nothing: it is shown as such, and no target is met by it.
inline constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

/// In microseconds. A percentile without samples above it is kNotMeasured: p90 of less than 10 samples, p99
/// of less than 100, p99.9 of less than 1,000, and all if there are none.
struct Summary {
  double p50 = kNotMeasured;
  double p90 = kNotMeasured;
  double p99 = kNotMeasured;
  double p999 = kNotMeasured;
  double max = kNotMeasured;
};

[[nodiscard]] Summary summarise(const Samples& samples);

/// Few samples lie above p99.9, and the figure of few is that of chance: for a verdict 20 must, rounded, or
/// it is kNotMeasured.
[[nodiscard]] double decisive_p999(const Samples& samples);

[[nodiscard]] constexpr double to_us(Duration value) noexcept {
  return static_cast<double>(value.count()) / 1e3;
}

/// kNotMeasured if there is nothing to compare with.
[[nodiscard]] constexpr double ratio(double ours, double floor) noexcept {
  return floor > 0 ? ours / floor : kNotMeasured;
}

/// Of two times in microseconds. Times are whole nanoseconds: a floor below ten of them is none.
[[nodiscard]] constexpr double ratio_of_times(double ours, double floor) noexcept {
  constexpr double kLeastFloor = 0.01;
  return floor >= kLeastFloor ? ratio(ours, floor) : kNotMeasured;
}

}  // namespace plchost::bench
