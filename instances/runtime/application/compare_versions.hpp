#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "instances/runtime/application/application_declaration.hpp"
#include "schedulers/tasks/task_config.hpp"

namespace plchost {

// The reasons against another version of an application taking over while it runs: a line for each, "task
// 'Fill': nPriority is 2, of the one that runs it is 1". Empty: nothing. Set-up.

/// The same tasks, in any order; all that the application or the settings say of them.
[[nodiscard]] std::vector<std::string> compare_tasks(std::span<const TaskConfig> running,
                                                     std::span<const TaskConfig> next);
/// The same areas, in any order, with the tasks that use them.
[[nodiscard]] std::vector<std::string> compare_areas(std::span<const DeclaredArea> running,
                                                     std::span<const DeclaredArea> next);
/// The type of a variable that is seen from outside, as people know it: "INT"; empty: it is not seen.
using TypeOfVariable = std::function<std::string(std::string_view name)>;
/// Variables that both name. Others may come and go.
[[nodiscard]] std::vector<std::string> compare_variables(
    const CarriedByName& running, const CarriedByName& next,
    const TypeOfVariable& running_type = [](std::string_view) { return std::string(); },
    const TypeOfVariable& next_type = [](std::string_view) { return std::string(); });

}  // namespace plchost
