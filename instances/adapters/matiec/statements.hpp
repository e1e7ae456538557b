#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "instances/adapters/iec/debug_pous.hpp"
#include "instances/adapters/matiec/joined_source.hpp"

namespace plchost::matiec {

/// The C code of iec2c with a PLC_STATEMENT before each statement.
struct DebugCode {
  std::string text;
  std::vector<iec::DebugPou> pous;  ///< their names in upper case, as iec2c writes them
};

/// `code`: POUS.c as "iec2c -O l" writes it, of this source: "#line N" is before each statement.
[[nodiscard]] DebugCode with_statements(std::string_view code, const JoinedSource& source);

}  // namespace plchost::matiec
