#pragma once

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <linux/hpet.h>
#include <linux/rtc.h>

#include "schedulers/clock/clock.hpp"
#include "schedulers/tick/device_file.hpp"

namespace plchost {

/// A clock device that a test makes, on the test's clock. The test's settings hold for all devices that are
/// opened.
class FakeClockDevice final : public DeviceFiles {
 public:
  enum class Kind : std::uint8_t { rtc, hpet, neither };

  explicit FakeClockDevice(Clock& clock, Kind kind = Kind::rtc) : clock_(clock), kind_(kind) {}

  double drift = 0;                 ///< of its crystal: 1e-4 ticks 100 ppm too fast
  std::atomic<bool> silent{false};  ///< no more ticks
  std::atomic<bool> broken{false};  ///< cannot be read any more
  std::atomic<bool> absent{false};  ///< cannot be opened
  std::atomic<int> opened{0};
  std::atomic<int> enabled{0};  ///< how often its interrupts were switched on
  std::atomic<int> disabled{0};
  std::atomic<unsigned long> frequency{0};
  int refuses_frequency = 0;  ///< errno

  Result<std::unique_ptr<DeviceFile>> open(const std::string& path) override {
    if (absent) return failure(ErrorCode::unavailable, "cannot open " + path, ENOENT);
    ++opened;
    return std::make_unique<File>(*this);
  }

 private:
  class File final : public DeviceFile {
   public:
    explicit File(FakeClockDevice& device) : device_(device) {}
    File(const File&) = delete;
    File& operator=(const File&) = delete;
    ~File() override { --device_.opened; }

    int control(unsigned long request, unsigned long argument) noexcept override {
      const bool rtc = device_.kind_ == Kind::rtc;
      const bool hpet = device_.kind_ == Kind::hpet;
      if ((rtc && request == RTC_IRQP_READ) || (hpet && request == HPET_INFO)) return 0;
      if ((rtc && request == RTC_IRQP_SET) || (hpet && request == HPET_IRQFREQ)) {
        if (device_.refuses_frequency != 0) return device_.refuses_frequency;
        device_.frequency = argument;
        return 0;
      }
      if ((rtc && request == RTC_PIE_ON) || (hpet && request == HPET_IE_ON)) {
        ++device_.enabled;
        begun_ = device_.clock_.now();
        taken_ = 0;
        return 0;
      }
      if ((rtc && request == RTC_PIE_OFF) || (hpet && request == HPET_IE_OFF)) {
        ++device_.disabled;
        return 0;
      }
      return ENOTTY;
    }

    Wait wait(TimePoint deadline) noexcept override {
      while (interrupted_.load() == 0) {
        if (device_.broken) return Wait::readable;
        if (!device_.silent && passed() > taken_) return Wait::readable;
        const TimePoint until = device_.silent ? deadline : std::min(deadline, tick_time(taken_ + 1));
        if (device_.clock_.now() >= deadline) return Wait::timed_out;
        device_.clock_.wait(interrupted_, 0, until);
      }
      interrupted_ = 0;
      return Wait::interrupted;
    }

    std::optional<unsigned long> read() noexcept override {
      if (device_.broken) return std::nullopt;
      const std::uint64_t count = device_.silent ? 0 : passed() - taken_;
      taken_ += count;
      return device_.kind_ == Kind::rtc ? (count << 8) | (count > 0 ? RTC_IRQF | RTC_PF : 0) : count;
    }

    void interrupt() noexcept override {
      interrupted_ = 1;
      device_.clock_.wake(interrupted_);
    }

   private:
    [[nodiscard]] double period() const noexcept {
      return 1e9 / (static_cast<double>(device_.frequency.load()) * (1 + device_.drift));
    }
    [[nodiscard]] TimePoint tick_time(std::uint64_t tick) const noexcept {
      return begun_ + Duration(std::llround(std::ceil(static_cast<double>(tick) * period())));
    }
    [[nodiscard]] std::uint64_t passed() const noexcept {
      auto count =
          static_cast<std::uint64_t>(static_cast<double>((device_.clock_.now() - begun_).count()) / period());
      while (tick_time(count + 1) <= device_.clock_.now()) ++count;
      return count;
    }

    FakeClockDevice& device_;
    TimePoint begun_;
    std::uint64_t taken_ = 0;
    std::atomic<std::uint32_t> interrupted_{0};
  };

  Clock& clock_;
  Kind kind_;
};

}  // namespace plchost
