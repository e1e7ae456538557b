#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "instances/adapters/matiec/joined_source.hpp"

namespace plchost::matiec {

/// A POU of a debug build, as plc_debug.h describes it.
struct DebugPou {
  std::string name;  ///< in upper case, as iec2c writes it
  std::string file;
  std::vector<unsigned> lines;  ///< ascending, each once
};

/// The C code of iec2c with a PLC_STATEMENT before each statement.
struct DebugCode {
  std::string text;
  std::vector<DebugPou> pous;  ///< each has the variable plchost_pou_N in C
};

/// The file in which the variables of the POUs are.
inline constexpr std::string_view kDebugFile = "plchost_pous.h";

/// `code`: POUS.c as "iec2c -O l" writes it, of this source: "#line N" is before each statement.
[[nodiscard]] DebugCode with_statements(std::string_view code, const JoinedSource& source);
/// The contents of kDebugFile.
[[nodiscard]] std::string debug_header(const std::vector<DebugPou>& pous);

}  // namespace plchost::matiec
