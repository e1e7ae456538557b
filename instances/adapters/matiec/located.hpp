#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace plchost::matiec {

/// A line of LOCATED_VARIABLES.h.
struct Located {
  std::string type;      ///< of the value, in C and in IEC: INT; in upper case
  std::string name;      ///< of the pointer in C: __IW2
  std::string location;  ///< %IW2
};

/// Lines of another form are left out: iec2c ends the file with remains of other output.
[[nodiscard]] std::vector<Located> located_variables(std::string_view file);

}  // namespace plchost::matiec
