#include "schedulers/settings/scheduler_settings.hpp"

#include <array>

#include <fmt/format.h>

namespace plchost {

namespace {

struct Unit {
  std::int64_t size;
  std::string_view name;
};
constexpr Unit kOne{.size = 1, .name = ""};
constexpr Unit kNs{.size = 1, .name = " ns"};
constexpr std::array kUnits{
    Unit{.size = Duration(std::chrono::days(1)).count(), .name = " days"},
    Unit{.size = Duration(std::chrono::hours(1)).count(), .name = " h"},
    Unit{.size = Duration(std::chrono::seconds(1)).count(), .name = " s"},
    Unit{.size = Duration(std::chrono::milliseconds(1)).count(), .name = " ms"},
    Unit{.size = Duration(std::chrono::microseconds(1)).count(), .name = " us"},
};

// In the largest unit of which it is a multiple.
std::string shown(std::int64_t number, const Unit& unit) {
  if (number == 0 || unit.name.empty()) return fmt::format("{}", number);
  for (const Unit& larger : kUnits) {
    if (number % larger.size == 0) return fmt::format("{}{}", number / larger.size, larger.name);
  }
  return fmt::format("{}{}", number, unit.name);
}

std::int64_t number_of(Duration value) {
  return value.count();
}
template <class Number>
std::int64_t number_of(Number value) {
  return static_cast<std::int64_t>(value);
}

template <class Range>
Result<void> check(const SchedulerSettings& settings, const Range& range) {
  constexpr Unit kUnit = std::is_same_v<typename Range::Value, Duration> ? kNs : kOne;
  const auto [lowest, highest] = range.in_programs;
  if (const auto value = Range::of(settings); value >= lowest && value <= highest) return {};
  const std::string zero = range.zero.empty() ? "" : fmt::format("; 0 is {}", range.zero);
  return failure(ErrorCode::invalid_argument,
                 fmt::format("scheduler setting {} must be {} to {}{}", range.name,
                             shown(number_of(lowest), kUnit), shown(number_of(highest), kUnit), zero));
}

}  // namespace

Result<void> check_settings(const SchedulerSettings& settings) {
  Result<void> checked;
  std::apply([&](const auto&... range) { (void)((checked = check(settings, range)) && ...); },
             kSettingRanges);
  return checked;
}

}  // namespace plchost
