#pragma once

#include <algorithm>

#include "shm/base/time.hpp"

namespace plchost {

/// How long before a release a task asks to be woken, so that it spins the rest and starts on time. Tracks
/// the quantile 1 - kDown / (kUp + kDown) of the wake-up latency: up quickly, down slowly. Pure.
class SpinGuard {
 public:
  static constexpr Duration kUp = std::chrono::microseconds(4);
  static constexpr Duration kDown = std::chrono::nanoseconds(20);

  /// `max` >= 0; 0 switches it off.
  explicit SpinGuard(Duration max) noexcept : max_(max), value_(max / 2) {}

  [[nodiscard]] Duration value() const noexcept { return value_; }

  /// A wake-up that was asked for came `latency` later. Real-time.
  void record(Duration latency) noexcept {
    // No guard within the bound helps against that one: it waited for a higher priority or for the host.
    if (latency > max_) return;
    value_ = latency > value_ ? std::min(value_ + kUp, max_) : std::max(value_ - kDown, Duration::zero());
  }

 private:
  Duration max_;
  Duration value_;
};

}  // namespace plchost
