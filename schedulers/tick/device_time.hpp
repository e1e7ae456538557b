#pragma once

#include <algorithm>
#include <cstdint>

#include "shm/base/time.hpp"

namespace plchost {

/// When the ticks of a device were due, on CLOCK_MONOTONIC: from their number and from when they were seen. A
/// tick is never seen before it is due, and of 64 the earliest was seen with next to no delay. So the line
/// through the earliest ones is the device's own time. It follows the device's drift against CLOCK_MONOTONIC
/// and is free of the wake-up latency of single ticks. Pure.
class DeviceTime {
 public:
  /// Of more than this (a crystal has 0.0001) the device does not keep its frequency.
  static constexpr double kMaxDrift = 0.001;

  /// `frequency` > 0, Hz. The next planned() is the first tick.
  void begin(std::uint32_t frequency) noexcept { *this = DeviceTime(frequency); }

  DeviceTime() noexcept = default;

  /// `ticks` more have passed (> 0), and the last of them is seen at `now`: when it was due. Never after
  /// `now`.
  [[nodiscard]] TimePoint planned(std::uint64_t ticks, TimePoint now) noexcept {
    if (!anchored_) {
      anchored_ = true;
      base_ = now;
      return now;
    }
    count_ += ticks;
    in_window_ += ticks;
    const double due = offset_ + rate_ * static_cast<double>(in_window_);
    const double late = static_cast<double>((now - base_ - nominal(count_)).count()) - due;
    if (late < earliest_) earliest_ = late;
    // Earlier than it was thought to be possible: from now on it is.
    const TimePoint when =
        base_ + nominal(count_) + Duration(static_cast<Duration::rep>(due + std::min(late, 0.0)));
    if (late < 0) {
      offset_ += late;
      corrected_ += late;
      earliest_ = 0;
    }
    if (in_window_ >= kWindow) close_window();
    return when;
  }

  /// How far the device's ticks are from where its frequency and CLOCK_MONOTONIC put them.
  [[nodiscard]] Duration deviation(TimePoint now) const noexcept { return now - base_ - nominal(count_); }
  [[nodiscard]] Duration elapsed(TimePoint now) const noexcept { return now - base_; }

 private:
  static constexpr std::uint64_t kWindow = 64;
  static constexpr double kNothing = 1e18;

  explicit DeviceTime(std::uint32_t frequency) noexcept : frequency_(frequency) {}

  // Exact, and without overflow for 292 years.
  [[nodiscard]] Duration nominal(std::uint64_t count) const noexcept {
    constexpr std::uint64_t kSecond = 1'000'000'000;
    return Duration(
        static_cast<Duration::rep>(count / frequency_ * kSecond + count % frequency_ * kSecond / frequency_));
  }

  // A regulator of second order: half of the error at once, an eighth of it into the rate.
  void close_window() noexcept {
    const double window = static_cast<double>(in_window_);
    offset_ += rate_ * window;
    const double error = corrected_ < 0 ? corrected_ : earliest_;
    if (error > 0) offset_ += error / 2;
    const double max_rate = kMaxDrift * 1e9 / frequency_;
    rate_ = std::clamp(rate_ + error / 8 / window, -max_rate, max_rate);
    in_window_ = 0;
    earliest_ = kNothing;
    corrected_ = 0;
  }

  std::uint32_t frequency_ = 1;
  bool anchored_ = false;
  TimePoint base_;           // of tick 0
  std::uint64_t count_ = 0;  // of the last tick
  // The ticks are due at base + nominal(count) + offset + rate * (ticks since the window began), ns.
  double offset_ = 0;
  double rate_ = 0;
  std::uint64_t in_window_ = 0;
  double earliest_ = kNothing;  // of this window, against what was due
  double corrected_ = 0;        // by which the window has moved the offset down
};

}  // namespace plchost
