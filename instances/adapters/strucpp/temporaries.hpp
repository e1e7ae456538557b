#pragma once

#include <string>
#include <string_view>

#include "instances/adapters/iec/project.hpp"

namespace plchost::strucpp {

/// The C++ of STruC++, in which the temporary variables of programs and function blocks have their initial
/// values at the begin of each call. By itself it keeps their values from call to call. All lines stay as
/// they are.
[[nodiscard]] std::string with_new_temporaries(std::string_view code, const iec::Project& project);

}  // namespace plchost::strucpp
