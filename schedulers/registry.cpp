#include <array>
#include <vector>

#include <fmt/format.h>

#include "schedulers/policies/cmp_schedule.hpp"
#include "schedulers/policies/cmp_schedule_one_shot.hpp"
#include "schedulers/policies/cmp_schedule_timer.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

template <class Policy>
constexpr SchedulerEntry kEntryOf{.name = Policy::kName,
                                  .make = [](const SchedulerContext& context) -> std::unique_ptr<Scheduler> {
                                    return std::make_unique<Policy>(context);
                                  }};

constexpr std::array kSchedulers{
    kEntryOf<CmpSchedule>,
    kEntryOf<CmpScheduleTimer>,
    kEntryOf<CmpScheduleOneShot>,
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
