#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "schedulers/tick/device_file.hpp"
#include "schedulers/tick/device_time.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// Why a device no longer ticks for us.
enum class TickFault : std::uint8_t { none, silent, off_frequency, broken };

/// A clock device with an interrupt of its own. It is a real-time clock (/dev/rtc*: RTC_IRQP_SET,
/// RTC_PIE_ON), an HPET (/dev/hpet: HPET_IRQFREQ, HPET_IE_ON), or whatever understands one of these two sets
/// of ioctls. The device itself is asked. It outlives the schedulers that it ticks for, so that an exchange
/// of them leaves its phase as it is.
class TickDevice {
 public:
  /// unavailable: it cannot be opened. unsupported: it is no such device. The text says why. Set-up.
  [[nodiscard]] static Result<std::shared_ptr<TickDevice>> open(DeviceFiles& files, const std::string& path);
  TickDevice(const TickDevice&) = delete;
  TickDevice& operator=(const TickDevice&) = delete;
  ~TickDevice() { halt(); }

  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  /// "that are powers of two": which it can make.
  [[nodiscard]] std::string_view frequencies() const noexcept {
    return kind_ == Kind::rtc ? "that are powers of two" : "in whole hertz";
  }

  /// invalid_argument: it cannot make this period; the text lists the nearest that it can. wrong_state: it
  /// ticks with another one, for a scheduler that runs. Set-up.
  [[nodiscard]] Result<void> set_period(Duration period);
  /// Hz, after set_period().
  [[nodiscard]] std::uint32_t frequency() const noexcept { return frequency_; }
  /// "Auxiliary /dev/rtc0 (RTC, 1024 Hz)"
  [[nodiscard]] std::string describe() const;

  /// Ticks from now on, if it does not already. False: it refuses. The thread that ticks; real-time.
  [[nodiscard]] bool run() noexcept;
  /// No more interrupts. Not while a thread waits.
  void halt() noexcept;
  [[nodiscard]] DeviceFile::Wait wait(TimePoint deadline) noexcept { return file_->wait(deadline); }
  void interrupt() noexcept { file_->interrupt(); }
  /// How many ticks have passed since it was last asked; nothing: it is broken. Real-time.
  [[nodiscard]] std::optional<std::uint64_t> take() noexcept;
  [[nodiscard]] DeviceTime& time() noexcept { return time_; }

  void fail(TickFault fault) noexcept { fault_.store(fault, std::memory_order_release); }
  /// Since the last run(). Any thread.
  [[nodiscard]] TickFault fault() const noexcept { return fault_.load(std::memory_order_acquire); }

 private:
  enum class Kind : std::uint8_t { rtc, hpet };

  TickDevice(std::string path, std::unique_ptr<DeviceFile> file, Kind kind) noexcept
      : path_(std::move(path)), file_(std::move(file)), kind_(kind) {}

  std::string path_;
  std::unique_ptr<DeviceFile> file_;
  Kind kind_;
  std::uint32_t frequency_ = 0;
  std::atomic<bool> runs_{false};  // the thread that ticks may halt it
  DeviceTime time_;
  std::atomic<TickFault> fault_{TickFault::none};
};

/// How long a device may be silent: 10 periods and 1 s.
[[nodiscard]] constexpr Duration tick_patience(Duration period) noexcept {
  return 10 * period + std::chrono::seconds(1);
}

/// "has not ticked for 10 periods and 1 s"
[[nodiscard]] std::string_view to_string(TickFault fault) noexcept;

}  // namespace plchost
