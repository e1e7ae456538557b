#pragma once

#include <compare>
#include <expected>
#include <string>
#include <string_view>
#include <vector>

namespace plchost::matiec {

/// A place in an area, as a located variable names it: %IX0.1 is byte 0, bit 1; %QW2 are the bytes 4 and 5.
struct Place {
  char area = 'I';      ///< I, Q or M
  unsigned offset = 0;  ///< of its first byte
  unsigned bytes = 1;   ///< 1, 2, 4 or 8
  int bit = -1;         ///< 0 to 7; -1: whole bytes
  auto operator<=>(const Place&) const = default;
};

/// The error says what is allowed.
[[nodiscard]] std::expected<Place, std::string> place_of(std::string_view location);

/// A line of LOCATED_VARIABLES.h.
struct Located {
  std::string type;      ///< of the value, in C and in IEC: INT; in upper case
  std::string name;      ///< of the pointer in C: __IW2
  std::string location;  ///< %IW2
};

/// Lines of another form are left out: iec2c ends the file with remains of other output.
[[nodiscard]] std::vector<Located> located_variables(std::string_view file);

/// Of an elementary type in upper case; 0: it is another one. BOOL has 1.
[[nodiscard]] unsigned bytes_of_type(std::string_view type) noexcept;

}  // namespace plchost::matiec
