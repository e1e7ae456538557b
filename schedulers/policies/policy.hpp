#pragma once

#include <memory>
#include <string_view>

#include "schedulers/activation/scheduler.hpp"
#include "schedulers/policies/registry.hpp"

namespace plchost {

template <class Policy>
SchedulerEntry make_policy_entry(std::string_view name) {
  return {.name = name,
          .make = [](const SchedulerContext& context) -> std::unique_ptr<Scheduler> {
            return std::make_unique<Policy>(context);
          },
          .halts_external_tasks = Policy::kHaltsExternalTasks};
}

}  // namespace plchost
