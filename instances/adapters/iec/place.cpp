#include "instances/adapters/iec/place.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <ranges>
#include <vector>

#include <fmt/format.h>

#include "instances/adapters/iec/tokens.hpp"

namespace plchost::iec {

namespace {

// An area has at most a mebibyte (PLC_MAX_IMAGE).
constexpr unsigned kMaxIndex = 0x100000;
constexpr unsigned kBits = 8;

std::vector<unsigned> numbers_of(std::string_view text) {
  std::vector<unsigned> numbers;
  for (const auto part : std::views::split(text, '.')) {
    const std::string digits(part.begin(), part.end());
    unsigned number = 0;
    const char* const end = digits.data() + digits.size();
    const auto read = std::from_chars(digits.data(), end, number);
    if (read.ec != std::errc() || read.ptr != end || number >= kMaxIndex) return {};
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

}  // namespace

std::expected<Place, std::string> place_of(std::string_view location) {
  const std::string upper = folded(location);
  const auto wrong = [&] {
    return std::unexpected(
        fmt::format("'{}' is no place: allowed are %I, %Q or %M with X0.0, B0, W0, D0 or L0", location));
  };
  std::string_view rest(upper);
  if (rest.size() < 3 || rest[0] != '%') return wrong();
  Place place{.area = rest[1]};
  if (place.area != 'I' && place.area != 'Q' && place.area != 'M') return wrong();
  const bool has_letter = rest[2] < '0' || rest[2] > '9';
  const char letter = has_letter ? rest[2] : 'X';
  rest.remove_prefix(has_letter ? 3 : 2);
  const std::vector<unsigned> numbers = numbers_of(rest);
  if (letter == 'X' && numbers.size() == 2 && numbers[1] < kBits) {
    place.offset = numbers[0];
    place.bit = static_cast<int>(numbers[1]);
  } else if (letter == 'X' && numbers.size() == 1) {
    place.offset = numbers[0] / kBits;
    place.bit = static_cast<int>(numbers[0] % kBits);
  } else if (bytes_of_letter(letter) != 0 && numbers.size() == 1) {
    place.bytes = bytes_of_letter(letter);
    place.offset = numbers[0] * place.bytes;
  } else {
    return wrong();
  }
  return place;
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
