#include "schedulers/scheduler_settings.hpp"

#include <array>

#include <fmt/format.h>

#include "schedulers/tasks/task_config.hpp"

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

/// The range of one setting.
struct Range {
  std::string_view name;
  std::int64_t value;
  std::int64_t lowest;
  std::int64_t highest;
  Unit unit = kOne;
  std::string_view zero;  ///< the meaning of 0, if that is a value of its own

  Range(std::string_view setting, Duration given, Duration low, Duration high, std::string_view of_zero = "")
      : name(setting),
        value(given.count()),
        lowest(low.count()),
        highest(high.count()),
        unit(kNs),
        zero(of_zero) {}
  Range(std::string_view setting, std::int64_t given, std::int64_t low, std::int64_t high,
        std::string_view of_zero = "")
      : name(setting), value(given), lowest(low), highest(high), zero(of_zero) {}
};

// In the largest unit of which it is a multiple.
std::string shown(std::int64_t number, const Unit& unit) {
  if (number == 0 || unit.name.empty()) return fmt::format("{}", number);
  for (const Unit& larger : kUnits) {
    if (number % larger.size == 0) return fmt::format("{}{}", number / larger.size, larger.name);
  }
  return fmt::format("{}{}", number, unit.name);
}

Result<void> check(const Range& range) {
  if (range.value >= range.lowest && range.value <= range.highest) return {};
  const std::string zero = range.zero.empty() ? "" : fmt::format("; 0 is {}", range.zero);
  return failure(ErrorCode::invalid_argument,
                 fmt::format("scheduler setting {} must be {} to {}{}", range.name,
                             shown(range.lowest, range.unit), shown(range.highest, range.unit), zero));
}

}  // namespace

Result<void> check_settings(const SchedulerSettings& settings) {
  using Limits = DistributedClockSettings;
  const Limits& clock = settings.distributed_clock;
  constexpr Duration kNone{};
  constexpr Duration kLeast{1};
  const std::array ranges{
      Range("scheduler_interval", settings.scheduler_interval, kLeast, kMaxInterval),
      Range("freewheeling_cycletime", settings.freewheeling_cycletime, kNone, kMaxInterval, "not set"),
      Range("processor_load_maximum", settings.processor_load_maximum, 0, kMaxProcessorLoad, "not set"),
      Range("spin_ahead_max", settings.spin_ahead_max, kNone, kMaxSpinAhead, "off"),
      Range("distributed_clock.kp_ppm", clock.kp_ppm, 1, Limits::kMaxGainPpm),
      Range("distributed_clock.ki_ppm", clock.ki_ppm, 0, Limits::kMaxGainPpm),
      Range("distributed_clock.max_correction", clock.max_correction, kNone, Limits::kMaxCorrection,
            "1 % of the interval"),
      Range("distributed_clock.sync_window", clock.sync_window, kLeast, Limits::kMaxWindow),
      Range("distributed_clock.pair_tolerance", clock.pair_tolerance, kLeast, Limits::kMaxWindow),
      Range("distributed_clock.reference_timeout", clock.reference_timeout, std::chrono::milliseconds(1),
            Limits::kMaxTimeout),
      Range("distributed_clock.hold_over_limit", clock.hold_over_limit, kNone, Limits::kMaxTimeout),
  };
  for (const Range& range : ranges) {
    if (auto fits = check(range); !fits) return fits;
  }
  if (settings.max_event_backlog >= 1) return {};
  return failure(ErrorCode::invalid_argument, "scheduler setting max_event_backlog must be at least 1");
}

}  // namespace plchost
