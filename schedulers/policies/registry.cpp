#include "schedulers/policies/registry.hpp"

#include <fmt/format.h>

#include "shm/base/names.hpp"

namespace plchost {

namespace {

template <class Policy>
SchedulerEntry entry_of(const PolicyName<Policy>& policy) {
  return make_policy_entry<Policy>(policy.name);
}

}  // namespace

std::span<const SchedulerEntry> all_schedulers() noexcept {
  static const auto schedulers =
      std::apply([](const auto&... policy) { return std::array{entry_of(policy)...}; }, kPolicies);
  return schedulers;
}

std::string scheduler_names() {
  return join_names(kSchedulerNames);
}

Result<const SchedulerEntry*> find_scheduler(std::string_view name) {
  for (const SchedulerEntry& entry : all_schedulers()) {
    if (entry.name == name) return &entry;
  }
  return failure(ErrorCode::invalid_argument,
                 fmt::format("there is no scheduler '{}'; known are {}", name, scheduler_names()));
}

}  // namespace plchost
