#include <array>
#include <vector>

#include <fmt/format.h>

#include "schedulers/cmp_schedule.hpp"
#include "schedulers/cmp_schedule_one_shot.hpp"
#include "schedulers/cmp_schedule_timer.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

constexpr std::array kSchedulers{
    SchedulerEntry{CmpSchedule::kName, &make_cmp_schedule},
    SchedulerEntry{CmpScheduleTimer::kName, &make_cmp_schedule_timer},
    SchedulerEntry{CmpScheduleOneShot::kName, &make_cmp_schedule_one_shot},
};

}  // namespace

std::span<const SchedulerEntry> all_schedulers() noexcept {
  return kSchedulers;
}

std::string scheduler_names() {
  std::vector<std::string_view> names;
  for (const SchedulerEntry& entry : kSchedulers) names.push_back(entry.name);
  return join_names(names);
}

Result<const SchedulerEntry*> find_scheduler(std::string_view name) {
  for (const SchedulerEntry& entry : kSchedulers) {
    if (entry.name == name) return &entry;
  }
  return failure(ErrorCode::invalid_argument,
                 fmt::format("there is no scheduler '{}'; known are {}", name, scheduler_names()));
}

}  // namespace plchost
