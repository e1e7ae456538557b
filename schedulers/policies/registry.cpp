#include "schedulers/policies/registry.hpp"

#include <fmt/format.h>

#include "shm/base/names.hpp"

namespace plchost {

namespace {

template <class Policy>
constexpr SchedulerEntry entry_of(const PolicyName<Policy>& policy) {
  return {
      .name = policy.name, .make = &make_policy<Policy>, .halts_external_tasks = kHaltsExternalTasks<Policy>};
}

constexpr std::array kSchedulers =
    std::apply([](const auto&... policy) { return std::array{entry_of(policy)...}; }, kPolicies);

}  // namespace

std::span<const SchedulerEntry> all_schedulers() noexcept {
  return kSchedulers;
}

std::string scheduler_names() {
  return join_names(kSchedulerNames);
}

Result<const SchedulerEntry*> find_scheduler(std::string_view name) {
  for (const SchedulerEntry& entry : kSchedulers) {
    if (entry.name == name) return &entry;
  }
  return failure(ErrorCode::invalid_argument,
                 fmt::format("there is no scheduler '{}'; known are {}", name, scheduler_names()));
}

}  // namespace plchost
