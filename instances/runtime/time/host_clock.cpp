#include "instances/runtime/time/host_clock.hpp"

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <linux/ptp_clock.h>

#include "schedulers/distributed_clock/clock_regulator.hpp"

namespace plchost {

namespace {

using Look = HostClock::Look;

/// Two readings of how far CLOCK_REALTIME is ahead of CLOCK_MONOTONIC differ by no more, or it was set.
constexpr Duration kSetBy = std::chrono::microseconds(2);

// Nothing: no time, or one that the regulator takes for rubbish.
std::optional<std::int64_t> nanoseconds_of(std::int64_t seconds, std::int64_t nanoseconds) noexcept {
  constexpr std::int64_t kSecond = 1'000'000'000;
  constexpr std::int64_t kMostSeconds = ClockRegulator::kMaxReferenceNs / kSecond - 1;
  const bool whole = nanoseconds >= 0 && nanoseconds < kSecond;
  if (!whole || seconds > kMostSeconds || seconds < -kMostSeconds) return std::nullopt;
  return seconds * kSecond + nanoseconds;
}
std::optional<std::int64_t> nanoseconds_of(const ptp_clock_time& time) noexcept {
  return nanoseconds_of(time.sec, time.nsec);
}

std::unexpected<Error> no_time(std::string_view clock) {
  return failure(ErrorCode::corrupt, fmt::format("{} shows a time that is none", clock));
}

Look between(TimePoint before, TimePoint after, std::int64_t reference_ns) noexcept {
  return {.pair = {.local = before + (after - before) / 2, .reference_ns = reference_ns},
          .width = after - before};
}

/// Reads `clock` several times; `name` is for the error.
Result<Look> look_at(ClockSystem& system, clockid_t clock, std::string_view name) {
  std::optional<Look> best;
  timespec before{};
  timespec time{};
  timespec after{};
  for (int i = 0; i < HostClock::kReadings; ++i) {
    int error = system.time(CLOCK_MONOTONIC, before);
    if (error == 0) error = system.time(clock, time);
    if (error == 0) error = system.time(CLOCK_MONOTONIC, after);
    if (error != 0) return failure(ErrorCode::unavailable, fmt::format("cannot read {}", name), error);
    const auto reference_ns = nanoseconds_of(time.tv_sec, time.tv_nsec);
    const auto from = nanoseconds_of(before.tv_sec, before.tv_nsec);
    const auto to = nanoseconds_of(after.tv_sec, after.tv_nsec);
    if (!reference_ns || !from || !to) return no_time(name);
    const Look look = between(TimePoint(Duration(*from)), TimePoint(Duration(*to)), *reference_ns);
    if (!best || look.width < best->width) best = look;
  }
  return *best;
}

class SystemClock final : public HostClock {
 public:
  SystemClock(ClockSystem& system, bool tai) noexcept : system_(system), tai_(tai) {}

  Result<Look> look() override {
    if (tai_ && system_.tai_offset() == 0) {
      return failure(ErrorCode::unavailable,
                     "CLOCK_TAI shows UTC: the kernel's TAI offset is 0; phc2sys, or chrony with leapsectz, "
                     "sets it");
    }
    return look_at(system_, tai_ ? CLOCK_TAI : CLOCK_REALTIME, describe());
  }
  std::string describe() const override { return tai_ ? "CLOCK_TAI" : "CLOCK_REALTIME"; }

 private:
  ClockSystem& system_;
  bool tai_;
};

/// A PTP device. The kernel reads it beside CLOCK_REALTIME, with one latch for both where the hardware has
/// it; where it cannot, the readings are made from here.
class PtpClock final : public HostClock {
 public:
  PtpClock(ClockSystem& system, std::string path, UniqueFd device) noexcept
      : system_(system), path_(std::move(path)), device_(std::move(device)) {}

  // A driver may lack one way, or refuse it for a moment: then the next one is as right, but wider.
  Result<Look> look() override {
    Result<Look> look = failure(ErrorCode::unsupported, path_);
    for (std::size_t way = way_; way < kWays.size(); ++way) {
      look = (this->*kWays[way].look)();
      if (look || look.error().code == ErrorCode::busy) return look;
      const bool lacked = way == way_ && is_lacking(look.error().system_errno);
      if (lacked && way + 1 < kWays.size()) ++way_;
    }
    return look;
  }
  std::string describe() const override { return fmt::format("{} ({})", path_, kWays[way_].name); }

 private:
  struct Way {
    std::string_view name;
    Result<Look> (PtpClock::*look)();
  };

  static bool is_lacking(int error) noexcept {
    return error == EOPNOTSUPP || error == ENOTTY || error == EINVAL || error == ENOSYS;
  }

  Result<Look> at_once() {
    PLCHOST_TRY_ASSIGN(const Look before, look_at(system_, CLOCK_REALTIME, "CLOCK_REALTIME"));
    ptp_sys_offset_precise stamps{};
    PLCHOST_TRY(ask(PTP_SYS_OFFSET_PRECISE, &stamps));
    const auto reference_ns = nanoseconds_of(stamps.device);
    const auto realtime_ns = nanoseconds_of(stamps.sys_realtime);
    if (!reference_ns || !realtime_ns) return no_time(path_);
    const TimePoint local{Duration(*realtime_ns)};
    return by_monotonic(between(local, local, *reference_ns), before);
  }

  Result<Look> between_two() {
    PLCHOST_TRY_ASSIGN(const Look before, look_at(system_, CLOCK_REALTIME, "CLOCK_REALTIME"));
    ptp_sys_offset_extended stamps{};
    stamps.n_samples = kReadings;
    PLCHOST_TRY(ask(PTP_SYS_OFFSET_EXTENDED, &stamps));
    std::optional<Look> best;
    for (const auto& stamp : std::span(stamps.ts).first(kReadings)) {
      const auto from = nanoseconds_of(stamp[0]);
      const auto reference_ns = nanoseconds_of(stamp[1]);
      const auto to = nanoseconds_of(stamp[2]);
      if (!from || !reference_ns || !to) return no_time(path_);
      const Look look = between(TimePoint(Duration(*from)), TimePoint(Duration(*to)), *reference_ns);
      // Backwards: CLOCK_REALTIME was set in between.
      if (look.width >= Duration::zero() && (!best || look.width < best->width)) best = look;
    }
    if (!best) return failure(ErrorCode::busy, "CLOCK_REALTIME was set");
    return by_monotonic(*best, before);
  }

  Result<Look> from_here() {
    constexpr unsigned kDeviceClock = 3;  // the clock of a file descriptor: FD_TO_CLOCKID in clock_getres(2)
    const auto clock = static_cast<clockid_t>((~static_cast<unsigned>(device_.get()) << 3U) | kDeviceClock);
    return look_at(system_, clock, path_);
  }

  [[nodiscard]] Result<void> ask(unsigned long request, void* argument) {
    const int error = system_.control(device_.get(), request, argument);
    if (error != 0) return failure(ErrorCode::unavailable, fmt::format("cannot read {}", path_), error);
    return {};
  }

  // `look` has CLOCK_REALTIME as its local time. `before`: that clock a moment ago.
  Result<Look> by_monotonic(Look look, const Look& before) {
    PLCHOST_TRY_ASSIGN(const Look after, look_at(system_, CLOCK_REALTIME, "CLOCK_REALTIME"));
    const auto ahead = [](const Look& seen) {
      return Duration(seen.pair.reference_ns) - seen.pair.local.time_since_epoch();
    };
    const Duration change = ahead(after) - ahead(before);
    if (std::chrono::abs(change) > kSetBy + (before.width + after.width) / 2) {
      return failure(ErrorCode::busy, "CLOCK_REALTIME was set");
    }
    look.pair.local -= ahead(before) + change / 2;
    look.width += (before.width + after.width) / 2;
    return look;
  }

  static constexpr std::array kWays{
      Way{.name = "PTP_SYS_OFFSET_PRECISE", .look = &PtpClock::at_once},
      Way{.name = "PTP_SYS_OFFSET_EXTENDED", .look = &PtpClock::between_two},
      Way{.name = "clock_gettime", .look = &PtpClock::from_here},
  };

  ClockSystem& system_;
  std::string path_;
  UniqueFd device_;
  std::size_t way_ = 0;
};

}  // namespace

Result<std::unique_ptr<HostClock>> HostClock::open(ClockSystem& system, const ReferenceName& name) {
  if (name.kind != ReferenceName::Kind::device) {
    return std::make_unique<SystemClock>(system, name.kind == ReferenceName::Kind::tai);
  }
  PLCHOST_TRY_ASSIGN(auto device, system.open(name.text));
  return std::make_unique<PtpClock>(system, name.text, std::move(device));
}

}  // namespace plchost
