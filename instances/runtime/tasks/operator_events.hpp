#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "shm/base/result.hpp"

namespace plchost {

/// The external events that the operator has registered, kept beside the control socket in
/// "RUN_DIRECTORY/NAME.events", one name per line: they outlive the process, until the operator unregisters
/// them.
[[nodiscard]] std::string operator_events_path(std::string_view run_directory, std::string_view instance);

/// Empty if there is no such file. Lines that are no event names are left out. system: it cannot be opened.
[[nodiscard]] Result<std::vector<std::string>> read_operator_events(const std::string& path);

/// Replaces the file as a whole, or removes it if there are none.
[[nodiscard]] Result<void> write_operator_events(const std::string& path,
                                                 const std::vector<std::string>& events);

}  // namespace plchost
