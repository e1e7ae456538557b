#pragma once

#include <string>
#include <vector>

namespace plchost::iec {

/// A place in a source file of the user.
struct SourcePlace {
  std::string file;
  unsigned line = 0;    ///< from 1; 0: the file as a whole
  unsigned column = 0;  ///< from 1, in bytes; 0: the line as a whole
  bool operator==(const SourcePlace&) const = default;
};

/// Something wrong in a source.
struct SourceProblem {
  SourcePlace place;
  std::string text;
  bool operator==(const SourceProblem&) const = default;
};

/// "FILE:LINE:COLUMN: TEXT", as far as the place is known.
[[nodiscard]] std::string describe(const SourceProblem& problem);

using SourceProblems = std::vector<SourceProblem>;

}  // namespace plchost::iec
