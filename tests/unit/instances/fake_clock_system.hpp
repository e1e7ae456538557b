#pragma once

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <fcntl.h>
#include <linux/ptp_clock.h>

#include "instances/runtime/time/clock_system.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// Clocks that a test sets, with a PTP device. Each reading takes some time.
class FakeClockSystem final : public ClockSystem {
 public:
  static constexpr std::int64_t kRealtimeAhead = 1'700'000'000'123'456'789;  // of CLOCK_MONOTONIC
  static constexpr std::int64_t kPhcAhead = kRealtimeAhead + 37'000'000'321;

  int time(clockid_t clock, timespec& to) noexcept override {
    if (clock == CLOCK_REALTIME && realtime_error != 0) return realtime_error;
    if (clock < 0 && device_error != 0) return device_error;
    pass();
    if (clock < 0 && phc_shows) {
      to = {.tv_sec = phc_shows->sec, .tv_nsec = phc_shows->nsec};
    } else {
      to = to_timespec(Duration(now_ + ahead_of(clock)));
    }
    return 0;
  }
  int tai_offset() noexcept override { return tai; }
  Result<UniqueFd> open(const std::string& path) override {
    if (missing) return failure(ErrorCode::unavailable, "open " + path, ENOENT);
    return UniqueFd(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  }
  int control(int /*device*/, unsigned long request, void* argument) noexcept override {
    if (at_control) at_control();
    if (request == PTP_SYS_OFFSET_PRECISE) {
      ++asked_precise;
      if (precise != 0) return precise;
      auto& stamps = *static_cast<ptp_sys_offset_precise*>(argument);
      pass();
      stamps.device = phc();
      stamps.sys_realtime = to_ptp(now_ + ahead_of(CLOCK_REALTIME));
      return 0;
    }
    if (request != PTP_SYS_OFFSET_EXTENDED) return ENOTTY;
    if (extended != 0) return extended;
    auto& stamps = *static_cast<ptp_sys_offset_extended*>(argument);
    for (auto& stamp : std::span(stamps.ts).first(stamps.n_samples)) {
      stamp[0] = to_ptp(now_ + ahead_of(CLOCK_REALTIME));
      pass();
      stamp[1] = phc();
      pass();
      stamp[2] = to_ptp(now_ + ahead_of(CLOCK_REALTIME));
    }
    return 0;
  }

  [[nodiscard]] TimePoint now() const noexcept { return TimePoint(Duration(now_)); }

  std::vector<Duration> delays;             // of the next readings, then kReading
  int tai = 0;                              // seconds
  int realtime_error = 0;                   // errno of reading CLOCK_REALTIME
  std::atomic<int> device_error{0};         // ... of reading the device by its number
  std::atomic<int> precise{0};              // errno of PTP_SYS_OFFSET_PRECISE
  std::atomic<int> extended{0};             // ... of PTP_SYS_OFFSET_EXTENDED
  std::atomic<bool> missing{false};         // there is no device
  int asked_precise = 0;                    // how often
  std::optional<ptp_clock_time> phc_shows;  // instead of its time
  std::function<void()> at_control;         // before an ioctl is carried out
  Duration realtime_set_by{};

 private:
  static constexpr Duration kReading = std::chrono::nanoseconds(200);
  // Of a device that is read by its number a clock's number is negative.
  [[nodiscard]] std::int64_t ahead_of(clockid_t clock) const noexcept {
    if (clock < 0) return kPhcAhead;
    if (clock == CLOCK_MONOTONIC) return 0;
    const std::int64_t realtime = kRealtimeAhead + realtime_set_by.count();
    return clock == CLOCK_TAI ? realtime + std::int64_t{tai} * 1'000'000'000 : realtime;
  }
  [[nodiscard]] ptp_clock_time phc() const noexcept { return phc_shows.value_or(to_ptp(now_ + kPhcAhead)); }
  static ptp_clock_time to_ptp(std::int64_t ns) noexcept {
    const timespec time = to_timespec(Duration(ns));
    ptp_clock_time result{};
    result.sec = time.tv_sec;
    result.nsec = static_cast<std::uint32_t>(time.tv_nsec);
    return result;
  }
  void pass() noexcept { now_ += (next_ < delays.size() ? delays[next_++] : kReading).count(); }

  std::atomic<std::int64_t> now_{5'000'000'000};
  std::size_t next_ = 0;
};

}  // namespace plchost
