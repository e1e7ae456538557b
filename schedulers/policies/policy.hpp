#pragma once

#include <memory>

#include "schedulers/registry.hpp"
#include "schedulers/scheduler.hpp"

namespace plchost {

template <class Policy>
std::unique_ptr<Scheduler> make_policy(const SchedulerContext& context) {
  return std::make_unique<Policy>(context);
}

}  // namespace plchost
