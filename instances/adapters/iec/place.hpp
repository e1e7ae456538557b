#pragma once

#include <compare>
#include <expected>
#include <string>
#include <string_view>

namespace plchost::iec {

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

/// Of an elementary type in upper case; 0: it is another one. BOOL has 1.
[[nodiscard]] unsigned bytes_of_type(std::string_view type) noexcept;

}  // namespace plchost::iec
