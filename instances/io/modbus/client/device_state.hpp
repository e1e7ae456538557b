#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>

#include "instances/io/modbus/config/modbus_config.hpp"
#include "shm/base/time.hpp"

namespace plchost::modbus {

/// How a device answers, as its thread tells it and others show it. Any thread.
class DeviceState {
 public:
  /// All inputs were read, the first of which was asked for at that time.
  void read(TimePoint asked_at) {
    const std::lock_guard lock(mutex_);
    read_at_ = asked_at;
  }
  /// The end of a poll: the inputs of the last reading are in their images. `exception`: of a refused
  /// request; 0: none.
  void polled(Quality quality, std::uint8_t exception) {
    const std::lock_guard lock(mutex_);
    shown_at_ = read_at_;
    quality_ = quality;
    if (exception != 0 || quality == Quality::good) exception_ = exception;
  }

  /// This process runs.
  void count() {
    const std::lock_guard lock(mutex_);
    ++counter_;
  }

  /// `good_for`: the age of inputs from which on they are not good; Duration::max(): none.
  [[nodiscard]] DeviceStatus status(TimePoint now, Duration good_for) const {
    const std::lock_guard lock(mutex_);
    const TimePoint at = later(now);
    const bool old = good_for != Duration::max() && (!shown_at_ || at - *shown_at_ >= good_for);
    const Quality quality = quality_ == Quality::good && old ? Quality::lost : quality_;
    return {.quality = static_cast<std::uint16_t>(quality),
            .exception = exception_,
            .counter = counter_,
            .age_ms = read_at_ ? in_ms(at - *read_at_) : kNeverRead};
  }
  /// The inputs are older than that, or were never read.
  [[nodiscard]] bool is_older(TimePoint now, Duration age) const {
    const std::lock_guard lock(mutex_);
    return !read_at_ || later(now) - *read_at_ >= age;
  }

 private:
  /// Two threads ask, and one of them may have looked at the clock long before: inputs that are too old for
  /// the other one are so for both.
  TimePoint later(TimePoint now) const noexcept {
    seen_ = std::max(seen_, now);
    return seen_;
  }
  [[nodiscard]] static std::uint32_t in_ms(Duration age) noexcept {
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(age).count();
    return ms < 0 ? 0 : ms >= kNeverRead ? kNeverRead - 1 : static_cast<std::uint32_t>(ms);
  }

  mutable std::mutex mutex_;
  Quality quality_ = Quality::none;
  std::uint8_t exception_ = 0;
  std::uint8_t counter_ = 0;
  std::optional<TimePoint> read_at_;
  std::optional<TimePoint> shown_at_;  ///< read_at_ of the inputs that are in their images
  mutable TimePoint seen_;
};

}  // namespace plchost::modbus
