#pragma once

#include <compare>
#include <expected>
#include <string>
#include <string_view>
#include <vector>

namespace plchost::iec {

/// A place in an area, as a located variable names it: %IX0.1 is byte 0, bit 1; %QW2 are the bytes 4 and 5.
struct Place {
  char area = 'I';      ///< I, Q or M
  unsigned offset = 0;  ///< of its first byte
  unsigned bytes = 1;   ///< 1, 2, 4 or 8
  int bit = -1;         ///< 0 to 7; -1: whole bytes
  auto operator<=>(const Place&) const = default;
};

/// Bits are counted from the begin of the area.
[[nodiscard]] unsigned first_bit(const Place& place) noexcept;
/// That behind the last one.
[[nodiscard]] unsigned end_bit(const Place& place) noexcept;

/// A location as it is written, also one of several numbers: %QW0.1.8192.0. It compares by area, numbers and
/// width.
struct Location {
  char area = 'I';                     ///< I, Q or M
  std::vector<unsigned> numbers = {};  ///< of %QX11: 1 and 3
  unsigned bytes = 1;                  ///< 1, 2, 4 or 8
  bool is_bit = false;
  auto operator<=>(const Location&) const = default;
  /// The numbers alone say where it lies: %QX0.1, %QW2.
  [[nodiscard]] bool is_direct() const noexcept;
  /// Bus, device and more: %QX0.1.2, %QW0.1.
  [[nodiscard]] bool is_hierarchical() const noexcept;
  /// "%QX0.1"
  [[nodiscard]] std::string text() const;
};

/// Whether bits, bytes, words, double words and long words of an area lie over one another, as in IEC
/// 61131-3, or one width behind the other, as in OpenPLC.
enum class Widths : unsigned char { shared, separate };

/// With Widths::separate there are this many bytes of bits, bytes, words, double words and long words.
inline constexpr unsigned kSeparatePlaces = 1024;
/// The error says what is allowed.
[[nodiscard]] std::expected<Location, std::string> location_of(std::string_view text);
/// Of a direct location. The error says what is allowed.
[[nodiscard]] std::expected<Place, std::string> place_of(const Location& location,
                                                         Widths widths = Widths::shared);
[[nodiscard]] std::expected<Place, std::string> place_of(std::string_view location);
/// The direct location of a place.
[[nodiscard]] Location location_of(const Place& place, Widths widths);

/// Of an elementary type in upper case; 0: it is another one. BOOL has 1.
[[nodiscard]] unsigned bytes_of_type(std::string_view type) noexcept;

}  // namespace plchost::iec
