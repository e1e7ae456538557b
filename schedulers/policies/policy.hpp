#pragma once

#include <memory>
#include <string_view>

#include "schedulers/activation/scheduler.hpp"
#include "schedulers/policies/registry.hpp"

namespace plchost {

/// The entry of the registry for one policy: in that policy's own file, which alone knows its class. Set-up.
template <class Policy>
SchedulerEntry make_policy_entry(std::string_view name) {
  return {.name = name,
          .make = [](const SchedulerContext& context) -> std::unique_ptr<Scheduler> {
            return std::make_unique<Policy>(context);
          },
          .halts_external_tasks = Policy::kHaltsExternalTasks};
}

}  // namespace plchost
