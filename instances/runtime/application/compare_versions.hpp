#pragma once

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
/// The variables of both versions that are seen from outside. They say more to the engineer than sizes and
/// layout numbers, which are those of a compiler. In the order of compare_variable_names().
struct SeenByBoth {
  std::span<const VariableSymbol> running;
  std::span<const VariableSymbol> next;
};
/// The same areas, in any order, with the tasks that use them. Where size or layout differ, the variables in
/// it do, if any is seen: those whose VariableSymbol::area is the name of the area.
[[nodiscard]] std::vector<std::string> compare_areas(std::span<const DeclaredArea> running,
                                                     std::span<const DeclaredArea> next,
                                                     const SeenByBoth& seen = {});
/// Variables that both name. Others may come and go. One that is not seen itself may have members that are:
/// "Main.part" has "Main.part.hours" and "Main.part[].x".
[[nodiscard]] std::vector<std::string> compare_variables(const CarriedByName& running,
                                                         const CarriedByName& next,
                                                         const SeenByBoth& seen = {});

}  // namespace plchost
