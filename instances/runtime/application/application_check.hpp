#pragma once

#include <string>

namespace plchost {

/// plc-instance --check-application: loads the file, runs its plc_app_init against a runtime that only
/// collects, and prints its tasks or what is wrong. `settings`: a settings file under which it is to run;
/// tasks, areas and events are then checked against it as at a start. Empty: none. Starts no task and touches
/// no pool. The exit code of the program.
[[nodiscard]] int check_application(const std::string& path, const std::string& settings);

}  // namespace plchost
