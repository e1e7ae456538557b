#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "instances/adapters/iec/debug_pous.hpp"
#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/source_place.hpp"
#include "instances/adapters/matiec/joined_source.hpp"

namespace plchost::matiec {

/// The C code of iec2c with a PLC_STATEMENT before each statement, and the comments of without_directives().
struct DebugCode {
  std::string text;
  std::vector<iec::DebugPou> pous;  ///< their names in upper case, as iec2c writes them
};

/// `code`: POUS.c as "iec2c -O l" writes it, of this source: "#line N" is before each statement. POUs that
/// `project` does not have are without local variables. The statements have the lines of the user's files.
[[nodiscard]] DebugCode with_statements(std::string_view code, const JoinedSource& source,
                                        const iec::Project& project, const iec::FindLine& find_line);

/// The same code for a compiler: each directive becomes a comment, so that the code has lines of its own.
[[nodiscard]] std::string without_directives(std::string_view code);

/// A line of the code, from 1; empty: it has none of this number.
[[nodiscard]] std::string_view line_in(std::string_view code, unsigned line);

/// The line of the joined source of which the statement is that this line of the code belongs to. `code`: of
/// without_directives() or with_statements(). 0: it belongs to none.
[[nodiscard]] unsigned joined_line_of(std::string_view code, unsigned line);

}  // namespace plchost::matiec
