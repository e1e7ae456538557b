#pragma once

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
  /// The end of a poll. `exception`: of a refused request; 0: none.
  void polled(Quality quality, std::uint8_t exception) {
    const std::lock_guard lock(mutex_);
    quality_ = quality;
    if (exception != 0 || quality == Quality::good) exception_ = exception;
  }

  /// This process runs.
  void count() {
    const std::lock_guard lock(mutex_);
    ++counter_;
  }

  [[nodiscard]] DeviceStatus status(TimePoint now) const {
    const std::lock_guard lock(mutex_);
    return {.quality = static_cast<std::uint16_t>(quality_),
            .exception = exception_,
            .counter = counter_,
            .age_ms = read_at_ ? in_ms(now - *read_at_) : kNeverRead};
  }
  /// The inputs are older than that, or were never read.
  [[nodiscard]] bool is_older(TimePoint now, Duration age) const {
    const std::lock_guard lock(mutex_);
    return !read_at_ || now - *read_at_ >= age;
  }

 private:
  [[nodiscard]] static std::uint32_t in_ms(Duration age) noexcept {
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(age).count();
    return ms < 0 ? 0 : ms >= kNeverRead ? kNeverRead - 1 : static_cast<std::uint32_t>(ms);
  }

  mutable std::mutex mutex_;
  Quality quality_ = Quality::none;
  std::uint8_t exception_ = 0;
  std::uint8_t counter_ = 0;
  std::optional<TimePoint> read_at_;
};

}  // namespace plchost::modbus
