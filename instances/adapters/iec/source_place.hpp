#pragma once

#include <functional>
#include <string>
#include <string_view>
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

/// The line of the user's file on which a line of its source stands. PLCopen XML becomes a source whose lines
/// are others than those of the file.
using FindLine = std::function<unsigned(std::string_view file, unsigned line)>;

}  // namespace plchost::iec
