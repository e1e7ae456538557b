#include "schedulers/cmp_schedule_one_shot.hpp"

#include <algorithm>

#include "schedulers/activation/deadline_source.hpp"

namespace plchost {

Result<std::unique_ptr<ActivationSource>> CmpScheduleOneShot::cyclic_source(const Task& task) {
  // Half of the period at least stays to others.
  const Duration guard = std::min(settings().spin_ahead_max, task.config().interval / 2);
  return std::make_unique<DeadlineSource>(clock(), task, FreewheelRule(settings()), guard);
}

std::unique_ptr<Scheduler> make_cmp_schedule_one_shot(const SchedulerContext& context) {
  return std::make_unique<CmpScheduleOneShot>(context);
}

}  // namespace plchost
