#pragma once

#include <string>
#include <string_view>

namespace plchost {

/// Writes down the faults of tasks that an instance shows in its page and could not write down itself. In
/// words the last one that it shows; empty: it shows none.
std::string keep_lost_faults(std::string_view pool, std::string_view run_directory,
                             std::string_view instance);

}  // namespace plchost
