#include "schedulers/settings/scheduler_settings.hpp"

#include <array>

#include <fmt/format.h>

#include "schedulers/settings/task_options.hpp"

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

  Range(std::string_view setting, Duration given, const Bounds<Duration>& bounds,
        std::string_view of_zero = "")
      : name(setting),
        value(given.count()),
        lowest(bounds.lowest.count()),
        highest(bounds.highest.count()),
        unit(kNs),
        zero(of_zero) {}
  template <class Number>
  Range(std::string_view setting, Number given, const Bounds<Number>& bounds, std::string_view of_zero = "")
      : name(setting),
        value(static_cast<std::int64_t>(given)),
        lowest(static_cast<std::int64_t>(bounds.lowest)),
        highest(static_cast<std::int64_t>(bounds.highest)),
        zero(of_zero) {}
};

// See kTickInFiles.
constexpr Bounds<Duration> kTick{.lowest = Duration(1), .highest = kMaxInterval};
constexpr Bounds<Duration> kFreewheelingCycletime{.lowest = Duration(0), .highest = kMaxInterval};

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
  const std::array ranges{
      Range("scheduler_interval", settings.scheduler_interval, kTick),
      Range("freewheeling_cycletime", settings.freewheeling_cycletime, kFreewheelingCycletime, "not set"),
      Range("processor_load_maximum", settings.processor_load_maximum, kProcessorLoad, "not set"),
      Range("spin_ahead_max", settings.spin_ahead_max, kSpinAhead, "off"),
      Range("max_event_backlog", settings.max_event_backlog, kEventBacklog),
      Range("distributed_clock.kp_ppm", clock.kp_ppm, Limits::kKpPpm),
      Range("distributed_clock.ki_ppm", clock.ki_ppm, Limits::kKiPpm),
      Range("distributed_clock.max_correction", clock.max_correction, Limits::kMaxCorrection,
            "1 % of the interval"),
      Range("distributed_clock.sync_window", clock.sync_window, Limits::kWindow),
      Range("distributed_clock.pair_tolerance", clock.pair_tolerance, Limits::kWindow),
      Range("distributed_clock.reference_timeout", clock.reference_timeout, Limits::kReferenceTimeout),
      Range("distributed_clock.hold_over_limit", clock.hold_over_limit, Limits::kHoldOver),
  };
  for (const Range& range : ranges) {
    if (auto fits = check(range); !fits) return fits;
  }
  return {};
}

}  // namespace plchost
