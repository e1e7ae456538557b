#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <tuple>

#include "shm/base/result.hpp"

namespace plchost {

class Scheduler;
struct SchedulerContext;

/// The name of the scheduler that is a class of policies/.
template <class Policy>
struct PolicyName {
  std::string_view name;
};

/// The schedulers, in the order in which they are listed. A new one is a file of its own in policies/ and a
/// line here.
inline constexpr std::tuple kPolicies{
    PolicyName<class CmpSchedule>{"CmpSchedule"},
    PolicyName<class CmpScheduleTimer>{"CmpScheduleTimer"},
    PolicyName<class CmpScheduleOneShot>{"CmpScheduleOneShot"},
};

/// Their names, for programs that do not link the schedulers.
inline constexpr std::array kSchedulerNames =
    std::apply([](const auto&... policy) { return std::array{policy.name...}; }, kPolicies);

/// A scheduler that can be chosen by name.
struct SchedulerEntry {
  std::string_view name;
  std::unique_ptr<Scheduler> (*make)(const SchedulerContext&);
  bool halts_external_tasks = false;  ///< see Scheduler::kHaltsExternalTasks
};

/// The entry of a scheduler. The file of `Policy` instantiates it, see policy.hpp.
template <class Policy>
[[nodiscard]] SchedulerEntry make_policy_entry(std::string_view name);

[[nodiscard]] std::span<const SchedulerEntry> all_schedulers() noexcept;
/// All of them in one text, with commas in between.
[[nodiscard]] std::string scheduler_names();
/// invalid_argument: no such scheduler; the text lists what there is.
[[nodiscard]] Result<const SchedulerEntry*> find_scheduler(std::string_view name);

}  // namespace plchost
