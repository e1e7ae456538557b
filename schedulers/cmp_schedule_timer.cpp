#include "schedulers/cmp_schedule_timer.hpp"

#include <utility>

#include "schedulers/activation/timer_source.hpp"

namespace plchost {

Result<std::unique_ptr<ActivationSource>> CmpScheduleTimer::cyclic_source(const Task& task) {
  auto timer = clock().make_periodic_timer();
  if (!timer) return std::unexpected(std::move(timer.error()));
  return std::make_unique<TimerSource>(clock(), task, FreewheelRule(settings()), std::move(*timer));
}

std::unique_ptr<Scheduler> make_cmp_schedule_timer(const SchedulerContext& context) {
  return std::make_unique<CmpScheduleTimer>(context);
}

}  // namespace plchost
