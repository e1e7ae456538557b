#pragma once

#include <cstddef>
#include <vector>

#include "shm/base/time.hpp"

namespace plchost::bench {

/// Figures of one kind, most of them latencies. Reserve before measuring: add() then allocates nothing.
class Samples {
 public:
  Samples() = default;
  explicit Samples(std::size_t capacity) { values_.reserve(capacity); }
  /// Drops what does not fit, so that a cycle never allocates.
  void add(Duration value) noexcept {
    if (values_.size() < values_.capacity()) values_.push_back(value);
  }
  /// For figures that are computed after measuring.
  void push(Duration value) { values_.push_back(value); }
  void append(const Samples& other) {
    values_.insert(values_.end(), other.values_.begin(), other.values_.end());
  }
  [[nodiscard]] std::size_t size() const noexcept { return values_.size(); }
  [[nodiscard]] const std::vector<Duration>& values() const noexcept { return values_; }

 private:
  std::vector<Duration> values_;
};

/// In microseconds; all 0 if there are no samples.
struct Summary {
  double p50 = 0;
  double p90 = 0;
  double p99 = 0;
  double p999 = 0;
  double max = 0;
};

[[nodiscard]] Summary summarise(const Samples& samples);

[[nodiscard]] constexpr double to_us(Duration value) noexcept {
  return static_cast<double>(value.count()) / 1e3;
}

/// 0 if there is nothing to compare with.
[[nodiscard]] constexpr double ratio(double ours, double floor) noexcept {
  return floor > 0 ? ours / floor : 0;
}

}  // namespace plchost::bench
