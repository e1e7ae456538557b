#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/source_place.hpp"

namespace plchost {

/// Of what a line of generated code was made.
struct FoundSource {
  iec::SourcePlace place;
  std::string subject = {};  ///< "variable 'grid'"; empty: a statement
  std::string advice = {};   ///< the way around an error there; empty: the error says enough
};
/// The source of this line of a file that a compiler for C or C++ names. Nothing: it is none of a source.
using FindSource = std::function<std::optional<FoundSource>(const std::string& file, unsigned line)>;

/// The errors of a compiler for C or C++ that have a place in a source. An error in a template of a header
/// has that of the line that needs it. Only declarations have a column: those that the compiler tells are of
/// the generated code.
[[nodiscard]] iec::SourceProblems problems_of_compiler(std::string_view output,
                                                       const FindSource& find_source);

/// The lines of its output from the first error on: without the files that include each other.
[[nodiscard]] std::string_view from_first_error(std::string_view output);

/// The symbol that the loader has not found, by its message; empty: it says something else.
[[nodiscard]] std::string undefined_symbol(std::string_view output);

/// The pragmas with C that use this name. One problem for each.
[[nodiscard]] iec::SourceProblems pragmas_with(std::string_view name, std::span<const iec::Source> sources);

/// Where this line of C stands in a pragma: iec2c copies it as it is. Nothing: in none, or in several places.
[[nodiscard]] std::optional<iec::SourcePlace> place_in_pragma(std::string_view line_of_c,
                                                              std::span<const iec::Source> sources);

}  // namespace plchost
