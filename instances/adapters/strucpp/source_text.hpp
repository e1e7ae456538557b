#pragma once

#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "instances/adapters/iec/project.hpp"

namespace plchost::strucpp {

/// A source as STruC++ gets it. All lines stay as they are.
struct SourceText {
  /// A place that a variable of a program has. The compiler lets no two variables have one, so it does not
  /// see it. Nor does it see one of several numbers that a global has.
  struct HiddenPlace {
    unsigned line;         ///< of the first name of the declaration
    std::string name;      ///< that name, folded
    std::string location;  ///< "%MW1"
  };
  struct Inserted {
    unsigned line;
    unsigned column;  ///< of the first character
    unsigned characters;
  };

  std::string text;
  std::vector<HiddenPlace> places;
  std::vector<Inserted> inserted;  ///< in order; each column is that of the source
};

/// The enumerations that the sources declare, by their folded names.
[[nodiscard]] std::set<std::string> enumerations_in(std::span<const iec::Source> sources);

/// The initial values of the VAR_GLOBAL CONSTANT, in Structured Text, by their folded names.
using Constants = std::map<std::string, std::string>;
[[nodiscard]] Constants constants_in(std::span<const iec::Source> sources);

/// Replaces the words that the compiler knows in another form only: Mode#busy, VAR_GLOBAL in a RESOURCE,
/// and places that several programs have. VAR_EXTERNAL CONSTANT gets an initial value, without which it is
/// refused.
/// Pragmas of other tools become blanks.
[[nodiscard]] SourceText text_for_strucpp(const iec::Source& source,
                                          const std::set<std::string>& enumerations,
                                          const Constants& constants);

}  // namespace plchost::strucpp
