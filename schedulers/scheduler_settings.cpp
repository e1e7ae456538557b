#include <fmt/format.h>

#include "schedulers/scheduler.hpp"

namespace plchost {

namespace {

std::unexpected<Error> bad(std::string_view setting, std::string_view allowed) {
  return failure(ErrorCode::invalid_argument,
                 fmt::format("scheduler setting {} must be {}", setting, allowed));
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
  return {};
}

}  // namespace plchost
