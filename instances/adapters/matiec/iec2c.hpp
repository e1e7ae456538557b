#pragma once

#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/source_place.hpp"
#include "instances/adapters/matiec/joined_source.hpp"
#include "shm/base/result.hpp"

namespace plchost::matiec {

/// A MATIEC that can be used.
struct Compiler {
  std::string program;  ///< iec2c
  std::string library;  ///< folder of its functions in ST (ieclib.txt)
  std::string headers;  ///< folder of its headers for C (iec_std_lib.h)
};

/// Looks in `folder` (of a built MATIEC, or where one is installed); empty: where PLCHOST_MATIEC says, else
/// in PATH. The error says how to get one.
[[nodiscard]] Result<Compiler> find_compiler(const std::string& folder);

/// The options that `help`, the output of "iec2c -h", tells, of these letters.
[[nodiscard]] std::vector<std::string> known_options(std::string_view help, std::string_view letters);

/// The name of the joined file, in the folder in which iec2c runs.
inline constexpr std::string_view kJoinedFile = "joined.st";

/// POUs that are called as one of the compiler's library (texts in the folder `library`). iec2c ends at them
/// without a place.
[[nodiscard]] iec::SourceProblems taken_names(const iec::Project& project, const std::string& library);

/// The names of the POUs in that library, folded.
[[nodiscard]] std::set<std::string> names_of_library(const std::string& library);

/// Variables, types and values of enumerations that are called as a POU of that library. iec2c refuses them
/// in other words.
[[nodiscard]] iec::SourceProblems taken_variables(const iec::Project& project,
                                                  std::span<const iec::Source> sources,
                                                  const std::string& library);

/// The errors in the output of iec2c, in the words and places of the sources. Errors in its own library (in
/// the folder `library`) come from a name of the program that the library has, too: that name is told, where
/// it is declared.
[[nodiscard]] iec::SourceProblems problems_of(std::string_view output, const JoinedSource& source,
                                              const iec::Project& project, const std::string& library);

/// The warnings in that output. Those in its own library are left out.
[[nodiscard]] iec::SourceProblems remarks_of(std::string_view output, const JoinedSource& source);

}  // namespace plchost::matiec
