#include "instances/launch/scheduler_choices.hpp"

#include "schedulers/scheduler.hpp"

namespace plchost {

std::vector<std::string_view> scheduler_choices() {
  std::vector<std::string_view> names;
  for (const SchedulerEntry& entry : all_schedulers()) names.push_back(entry.name);
  return names;
}

}  // namespace plchost
