#include "schedulers/scheduler_settings.hpp"

#include <fmt/format.h>

#include "schedulers/task/task_config.hpp"

namespace plchost {

namespace {

std::unexpected<Error> bad(std::string_view setting, std::string_view allowed) {
  return failure(ErrorCode::invalid_argument,
                 fmt::format("scheduler setting {} must be {}", setting, allowed));
}

bool within(Duration value, Duration lowest, Duration highest) {
  return value >= lowest && value <= highest;
}

Result<void> check_distributed_clock(const DistributedClockSettings& clock) {
  using Settings = DistributedClockSettings;
  if (clock.kp_ppm < 1 || clock.kp_ppm > Settings::kMaxGainPpm) {
    return bad("distributed_clock.kp_ppm", "1 to 1000000");
  }
  if (clock.ki_ppm < 0 || clock.ki_ppm > Settings::kMaxGainPpm) {
    return bad("distributed_clock.ki_ppm", "0 to 1000000");
  }
  if (!within(clock.max_correction, Duration::zero(), Settings::kMaxCorrection)) {
    return bad("distributed_clock.max_correction", "0 (1 % of the interval) to 100 ms");
  }
  if (!within(clock.sync_window, Duration(1), Settings::kMaxWindow)) {
    return bad("distributed_clock.sync_window", "1 ns to 1 s");
  }
  if (!within(clock.pair_tolerance, Duration(1), Settings::kMaxWindow)) {
    return bad("distributed_clock.pair_tolerance", "1 ns to 1 s");
  }
  if (!within(clock.reference_timeout, std::chrono::milliseconds(1), Settings::kMaxTimeout)) {
    return bad("distributed_clock.reference_timeout", "1 ms to 1 hour");
  }
  if (!within(clock.hold_over_limit, Duration::zero(), Settings::kMaxTimeout)) {
    return bad("distributed_clock.hold_over_limit", "0 to 1 hour");
  }
  return {};
}

}  // namespace

Result<void> check_settings(const SchedulerSettings& settings) {
  if (settings.scheduler_interval <= Duration::zero() || settings.scheduler_interval > kMaxInterval) {
    return bad("scheduler_interval", "above 0 and at most 50 days");
  }
  if (settings.freewheeling_cycletime < Duration::zero() || settings.freewheeling_cycletime > kMaxInterval) {
    return bad("freewheeling_cycletime", "0 (not set) to 50 days");
  }
  if (settings.processor_load_maximum < 0 || settings.processor_load_maximum > kMaxProcessorLoad) {
    return bad("processor_load_maximum", "1 to 100 percent, or 0 (not set)");
  }
  if (settings.spin_ahead_max < Duration::zero() || settings.spin_ahead_max > kMaxSpinAhead) {
    return bad("spin_ahead_max", "0 (off) to 1 ms");
  }
  if (settings.max_event_backlog < 1) return bad("max_event_backlog", "at least 1");
  return check_distributed_clock(settings.distributed_clock);
}

}  // namespace plchost
