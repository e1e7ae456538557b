#pragma once

#include <memory>

#include "schedulers/activation/scheduler.hpp"
#include "schedulers/policies/registry.hpp"

namespace plchost {

template <class Policy>
std::unique_ptr<Scheduler> make_policy(const SchedulerContext& context) {
  return std::make_unique<Policy>(context);
}

}  // namespace plchost
