#pragma once

#include "instances/runtime/setup/options.hpp"

namespace plchost {

/// plc-instance --check-application: does all that a start with these options does, by the same functions,
/// but takes nothing from an instance of that name that runs; then prints the tasks, or the first thing that
/// is wrong. It starts no task, calls no hook of a component, opens no device, makes nothing in the pool and
/// writes no file. A pool that is not there is not looked at. The exit code of the program.
[[nodiscard]] int check_application(const Options& options);

}  // namespace plchost
