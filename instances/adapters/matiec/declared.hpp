#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "instances/adapters/iec/project.hpp"

namespace plchost::matiec {

/// A declaration of the sources.
struct Declaration {
  std::string what;  ///< for people: "variable 'grid'"
  iec::SourcePlace place;
  bool operator==(const Declaration&) const = default;
};

/// The variable, the type or the POU of which iec2c has made this line, from 1, of one of its files. It is a
/// member of a structure, an initial value or a global. Any code. Nothing: it is made of none, or of a
/// statement.
[[nodiscard]] std::optional<Declaration> declared_in(std::string_view code, unsigned line,
                                                     const iec::Project& project);

}  // namespace plchost::matiec
