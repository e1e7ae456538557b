#include "instances/adapters/iec/place.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <ranges>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "instances/adapters/iec/tokens.hpp"

namespace plchost::iec {

namespace {

// An area has at most a mebibyte (PLC_MAX_IMAGE).
constexpr unsigned kMaxIndex = 0x100000;
constexpr unsigned kBits = 8;
constexpr std::size_t kMostNumbers = 16;

// None: it is no list of numbers, or too long a one.
std::vector<unsigned> numbers_of(std::string_view text) {
  std::vector<unsigned> numbers;
  for (const auto part : std::views::split(text, '.')) {
    const std::string digits(part.begin(), part.end());
    unsigned number = 0;
    const char* const end = digits.data() + digits.size();
    const auto read = std::from_chars(digits.data(), end, number);
    if (read.ec != std::errc() || read.ptr != end || numbers.size() == kMostNumbers) return {};
    numbers.push_back(number);
  }
  return numbers;
}

unsigned bytes_of_letter(char letter) noexcept {
  switch (letter) {
    case 'B':
      return 1;
    case 'W':
      return 2;
    case 'D':
      return 4;
    case 'L':
      return 8;
    default:
      return 0;
  }
}

char letter_of(const Location& location) noexcept {
  if (location.is_bit) return 'X';
  switch (location.bytes) {
    case 1:
      return 'B';
    case 2:
      return 'W';
    case 4:
      return 'D';
    default:
      return 'L';
  }
}

std::string no_place(std::string_view location) {
  return fmt::format("'{}' is no place: allowed are %I, %Q or %M with X0.0, B0, W0, D0 or L0", location);
}

// Where the places of its width begin.
unsigned begin_of(const Location& location, Widths widths) noexcept {
  return widths == Widths::shared || location.is_bit ? 0 : kSeparatePlaces * location.bytes;
}

}  // namespace

unsigned first_bit(const Place& place) noexcept {
  return place.offset * kBits + static_cast<unsigned>(std::max(place.bit, 0));
}
unsigned end_bit(const Place& place) noexcept {
  return place.bit < 0 ? (place.offset + place.bytes) * kBits : first_bit(place) + 1;
}

bool Location::is_direct() const noexcept {
  return is_bit ? numbers.size() == 2 && numbers[1] < kBits : numbers.size() == 1;
}

bool Location::is_hierarchical() const noexcept {
  return numbers.size() > (is_bit ? 2U : 1U);
}

std::string Location::text() const {
  return fmt::format("%{}{}{}", area, letter_of(*this), fmt::join(numbers, "."));
}

std::expected<Location, std::string> location_of(std::string_view text) {
  const std::string upper = folded(text);
  const auto wrong = [&] { return std::unexpected(no_place(text)); };
  std::string_view rest(upper);
  if (rest.size() < 3 || rest[0] != '%') return wrong();
  Location location{.area = rest[1]};
  if (location.area != 'I' && location.area != 'Q' && location.area != 'M') return wrong();
  const bool has_letter = rest[2] < '0' || rest[2] > '9';
  const char letter = has_letter ? rest[2] : 'X';
  rest.remove_prefix(has_letter ? 3 : 2);
  location.is_bit = letter == 'X';
  location.bytes = location.is_bit ? 1 : bytes_of_letter(letter);
  location.numbers = numbers_of(rest);
  if (location.bytes == 0 || location.numbers.empty()) return wrong();
  if (location.is_bit && location.numbers.size() == 1) {
    const unsigned number = location.numbers.front();
    location.numbers = {number / kBits, number % kBits};
  }
  return location;
}

std::expected<Place, std::string> place_of(const Location& location, Widths widths) {
  if (!location.is_direct())
    return std::unexpected(no_place(location.text()) + ", or give it a line in [location] of the task file");
  const unsigned number = location.numbers.front();
  const unsigned most = widths == Widths::separate ? kSeparatePlaces : kMaxIndex;
  if (number >= most) {
    return std::unexpected(
        fmt::format("'{}' is no place: allowed are the numbers 0 to {} there", location.text(), most - 1));
  }
  return Place{.area = location.area,
               .offset = begin_of(location, widths) + number * location.bytes,
               .bytes = location.bytes,
               .bit = location.is_bit ? static_cast<int>(location.numbers[1]) : -1};
}

std::expected<Place, std::string> place_of(std::string_view location) {
  const auto known = location_of(location);
  if (!known) return std::unexpected(known.error());
  return place_of(*known);
}

Location location_of(const Place& place, Widths widths) {
  Location location{.area = place.area, .bytes = place.bytes, .is_bit = place.bit >= 0};
  location.numbers.push_back((place.offset - begin_of(location, widths)) / place.bytes);
  if (location.is_bit) location.numbers.push_back(static_cast<unsigned>(place.bit));
  return location;
}

unsigned bytes_of_type(std::string_view type) noexcept {
  struct Size {
    std::string_view type;
    unsigned bytes;
  };
  constexpr std::array<Size, 15> kSizes{{{"BOOL", 1},
                                         {"SINT", 1},
                                         {"USINT", 1},
                                         {"BYTE", 1},
                                         {"INT", 2},
                                         {"UINT", 2},
                                         {"WORD", 2},
                                         {"DINT", 4},
                                         {"UDINT", 4},
                                         {"DWORD", 4},
                                         {"REAL", 4},
                                         {"LINT", 8},
                                         {"ULINT", 8},
                                         {"LWORD", 8},
                                         {"LREAL", 8}}};
  const auto* const found = std::ranges::find(kSizes, type, &Size::type);
  return found == kSizes.end() ? 0 : found->bytes;
}

}  // namespace plchost::iec
