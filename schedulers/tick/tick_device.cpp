#include "schedulers/tick/tick_device.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <linux/hpet.h>
#include <linux/rtc.h>

namespace plchost {

namespace {

constexpr double kNsPerSecond = 1e9;
constexpr std::uint32_t kLowestRtc = 2;
constexpr std::uint32_t kHighestRtc = 8192;
constexpr std::uint32_t kHighestHpet = 100'000;

template <class T>
unsigned long address_of(T& value) noexcept {
  return reinterpret_cast<unsigned long>(&value);
}

Duration period_of(std::uint32_t hertz) noexcept {
  return Duration(static_cast<Duration::rep>(std::llround(kNsPerSecond / hertz)));
}

// The frequencies around a period, the higher one first. Both may be the same.
std::pair<std::uint32_t, std::uint32_t> around(Duration period, bool powers_of_two) noexcept {
  const double wanted = kNsPerSecond / static_cast<double>(period.count());
  if (!powers_of_two) {
    const auto clamp = [](double hertz) {
      return static_cast<std::uint32_t>(std::clamp(hertz, 1.0, static_cast<double>(kHighestHpet)));
    };
    return {clamp(std::ceil(wanted)), clamp(std::floor(wanted))};
  }
  std::uint32_t higher = kLowestRtc;
  while (higher < kHighestRtc && higher < wanted) higher *= 2;
  return {higher, higher > kLowestRtc && higher > wanted ? higher / 2 : higher};
}

std::string shown(std::uint32_t hertz) {
  return fmt::format("{:.10g} us ({} Hz)", 1e6 / hertz, hertz);
}

}  // namespace

Result<std::shared_ptr<TickDevice>> TickDevice::open(DeviceFiles& files, const std::string& path) {
  PLCHOST_TRY_ASSIGN(auto file, files.open(path));
  unsigned long hertz = 0;
  const int no_rtc = file->control(RTC_IRQP_READ, address_of(hertz));
  hpet_info info{};
  const int no_hpet = no_rtc == 0 ? 0 : file->control(HPET_INFO, address_of(info));
  if (no_hpet != 0) {
    return failure(
        ErrorCode::unsupported,
        fmt::format("{} is no clock with periodic interrupts: it has neither RTC_IRQP_READ (errno {}) "
                    "nor HPET_INFO (errno {})",
                    path, no_rtc, no_hpet));
  }
  const Kind kind = no_rtc == 0 ? Kind::rtc : Kind::hpet;
  return std::shared_ptr<TickDevice>(new TickDevice(path, std::move(file), kind));
}

Result<void> TickDevice::set_period(Duration period) {
  const auto [higher, lower] = around(period, kind_ == Kind::rtc);
  const bool is_higher = period_of(higher) == period;
  const std::uint32_t hertz = is_higher ? higher : lower;
  if (period_of(hertz) != period) {
    const std::string nearest =
        higher == lower ? shown(higher) : fmt::format("{} and {}", shown(higher), shown(lower));
    return failure(ErrorCode::invalid_argument,
                   fmt::format("{} cannot tick every {:.10g} us; the nearest that it can: {}", path_,
                               static_cast<double>(period.count()) / 1e3, nearest));
  }
  if (runs_ && hertz == frequency_) return {};
  if (runs_) {
    return failure(ErrorCode::wrong_state,
                   fmt::format("{} ticks at {} Hz for the tasks that run and cannot tick at {} Hz meanwhile: "
                               "stop them first",
                               path_, frequency_, hertz));
  }
  const int refused = file_->control(kind_ == Kind::rtc ? RTC_IRQP_SET : HPET_IRQFREQ, hertz);
  if (refused != 0) {
    return failure(
        ErrorCode::refused,
        fmt::format("{} refuses {} Hz{}", path_, hertz,
                    refused == EACCES ? " (above its max_user_freq it needs CAP_SYS_RESOURCE)" : ""),
        refused);
  }
  frequency_ = hertz;
  return {};
}

std::string TickDevice::describe() const {
  return fmt::format("Auxiliary {} ({}, {} Hz)", path_, kind_ == Kind::rtc ? "RTC" : "HPET", frequency_);
}

bool TickDevice::run() noexcept {
  fail(TickFault::none);
  if (runs_) return true;
  time_.begin(frequency_);
  runs_ = file_->control(kind_ == Kind::rtc ? RTC_PIE_ON : HPET_IE_ON, 0) == 0;
  return runs_;
}

void TickDevice::halt() noexcept {
  if (!runs_) return;
  runs_ = false;
  (void)file_->control(kind_ == Kind::rtc ? RTC_PIE_OFF : HPET_IE_OFF, 0);
}

std::optional<std::uint64_t> TickDevice::take() noexcept {
  const auto word = file_->read();
  if (!word) return std::nullopt;
  constexpr unsigned kCountShift = 8;  // below it an RTC says of what kind the interrupts were
  return kind_ == Kind::rtc ? *word >> kCountShift : *word;
}

std::string_view to_string(TickFault fault) noexcept {
  switch (fault) {
    case TickFault::none:
      return "ticks";
    case TickFault::silent:
      return "has not ticked for 10 periods and 1 s";
    case TickFault::off_frequency:
      return "does not keep its frequency";
    case TickFault::broken:
      return "can no longer be read";
  }
  return "unknown";
}

}  // namespace plchost
