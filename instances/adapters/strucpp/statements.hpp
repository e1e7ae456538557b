#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "instances/adapters/iec/debug_pous.hpp"
#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/strucpp/cpp_values.hpp"

namespace plchost::strucpp {

/// C++ of STruC++ with a PLC_STATEMENT before each statement.
struct DebugCode {
  std::vector<std::string> texts;  ///< for each given one
  std::vector<iec::DebugPou> pous;
};

/// `codes`: files that STruC++ has written, with "#line N" before each statement. POUs that no source of this
/// project declares stay as they are.
[[nodiscard]] DebugCode with_statements(std::span<const std::string> codes, const iec::Project& project,
                                        const CppValues& values);

}  // namespace plchost::strucpp
