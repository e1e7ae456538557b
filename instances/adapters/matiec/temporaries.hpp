#pragma once

#include <string>
#include <string_view>

#include "instances/adapters/iec/project.hpp"
#include "instances/adapters/iec/tokens.hpp"

namespace plchost::matiec {

// iec2c writes C that does not compile for arrays and structures in VAR_TEMP. So it gets them in VAR, and the
// code sets them to their initial values in each call.

/// Of a word of the sources, in its order: whether it is the VAR_TEMP of a program or of a function block.
class TemporarySections {
 public:
  [[nodiscard]] bool begins_one(const iec::Token& token);

 private:
  bool in_function_ = false;
};

/// POUS.c, in which each body begins with the initial values of the temporary variables of its POU.
[[nodiscard]] std::string with_temporary_values(std::string_view code, const iec::Project& project);

}  // namespace plchost::matiec
