#include "shm/variables/string_text.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstddef>
#include <iterator>
#include <optional>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/base/utf8.hpp"

namespace plchost {

namespace {

/// They differ between texts of bytes and of units of UTF-16.
template <class Character>
constexpr char kQuoteOf = sizeof(Character) == 1 ? kQuote : kWideQuote;
template <class Character>
constexpr std::size_t kDigits = 2 * sizeof(Character);

constexpr char32_t kFirstHigh = 0xd800;
constexpr char32_t kFirstLow = 0xdc00;
constexpr char32_t kBehindLow = 0xe000;
constexpr char32_t kFirstOfPairs = 0x10000;

bool is_control(char c) noexcept {
  constexpr char kDelete = 0x7f;
  return (static_cast<unsigned char>(c) < ' ') || c == kDelete;
}

// ---- to text

/// The character that the units begin with; a unit of no pair is itself.
char32_t first_character(std::u16string_view units) noexcept {
  const char32_t first = units[0];
  if (first < kFirstHigh || first >= kFirstLow || units.size() < 2) return first;
  const char32_t second = units[1];
  if (second < kFirstLow || second >= kBehindLow) return first;
  return kFirstOfPairs + ((first - kFirstHigh) << 10U) + (second - kFirstLow);
}

std::string utf8_of(char32_t character) {
  const auto part = [&](unsigned shift) { return static_cast<char>(0x80U | ((character >> shift) & 0x3fU)); };
  if (character < 0x80) return {static_cast<char>(character)};
  if (character < 0x800) return {static_cast<char>(0xc0U | (character >> 6U)), part(0)};
  if (character < kFirstOfPairs) return {static_cast<char>(0xe0U | (character >> 12U)), part(6), part(0)};
  return {static_cast<char>(0xf0U | (character >> 18U)), part(12), part(6), part(0)};
}

// ---- from text

/// The character that the text begins with, without a meaning of its own; false: it is none.
bool take_plain(std::string_view& text, std::string& characters) {
  characters += text.front();
  text.remove_prefix(1);
  return true;
}
bool take_plain(std::string_view& text, std::u16string& units) {
  const auto character = first_utf8(text);
  if (!character) return false;
  text.remove_prefix(character->bytes);
  const char32_t code = character->code;
  if (code < kFirstOfPairs) {
    units += static_cast<char16_t>(code);
  } else {
    units += static_cast<char16_t>(kFirstHigh + ((code - kFirstOfPairs) >> 10U));
    units += static_cast<char16_t>(kFirstLow + ((code - kFirstOfPairs) & 0x3ffU));
  }
  return true;
}

/// The character that stands behind a $; nothing: there is none. `text` goes on behind it.
template <class Character>
std::optional<Character> take_escape(std::string_view& text) {
  if (text.empty()) return std::nullopt;
  constexpr std::array kNames = {'$', kQuoteOf<Character>, 'L', 'N', 'P', 'R', 'T'};
  constexpr std::array kMeant = {'$', kQuoteOf<Character>, '\n', '\n', '\f', '\r', '\t'};
  const char upper = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  if (const auto* const found = std::ranges::find(kNames, upper); found != kNames.end()) {
    text.remove_prefix(1);
    return static_cast<Character>(kMeant.at(static_cast<std::size_t>(found - kNames.begin())));
  }
  unsigned code = 0;
  constexpr int kHexadecimal = 16;
  const std::string_view digits = text.substr(0, kDigits<Character>);
  const auto parsed = std::from_chars(digits.begin(), digits.end(), code, kHexadecimal);
  if (digits.size() < kDigits<Character> || parsed.ptr != digits.end()) return std::nullopt;
  text.remove_prefix(digits.size());
  return static_cast<Character>(code);
}

template <class Character>
Result<std::basic_string<Character>> parse(std::string_view text) {
  constexpr char kMark = kQuoteOf<Character>;
  constexpr bool kIsWide = sizeof(Character) > 1;
  const bool in_quotes = text.starts_with(kMark);
  std::string_view rest = in_quotes ? text.substr(1) : text;
  std::basic_string<Character> characters;
  bool good = true;
  while (good && !rest.empty() && !(in_quotes && rest.front() == kMark)) {
    if (!in_quotes || rest.front() != '$') {
      good = take_plain(rest, characters);
      continue;
    }
    rest.remove_prefix(1);
    const auto meant = take_escape<Character>(rest);
    good = meant.has_value();
    if (meant) characters += *meant;
  }
  if (good && (!in_quotes || rest.size() == 1)) return characters;
  return failure(
      ErrorCode::invalid_argument,
      fmt::format("'{}' is not allowed here; allowed is {}{}text{} with $$, ${}, $L, $N, $P, $R, $T "
                  "or $ and {} hexadecimal digits in it",
                  shown(text), kIsWide ? "UTF-8, as " : "", kMark, kMark, kMark, kIsWide ? "four" : "two"));
}

}  // namespace

std::string string_text(std::string_view characters) {
  std::string plain(characters);
  std::ranges::replace_if(plain, is_control, ' ');
  const bool utf8 = is_printable_utf8(plain);
  std::string text(1, kQuote);
  for (const char c : characters) {
    const bool high = (static_cast<unsigned char>(c) & 0x80U) != 0;
    if (is_control(c) || (high && !utf8)) {
      fmt::format_to(std::back_inserter(text), "${:02X}", static_cast<unsigned char>(c));
    } else {
      if (c == '$' || c == kQuote) text += '$';
      text += c;
    }
  }
  return text + kQuote;
}

std::string string_text(std::u16string_view units) {
  std::string text(1, kWideQuote);
  while (!units.empty()) {
    const char32_t character = first_character(units);
    const std::size_t count = character < kFirstOfPairs ? 1 : 2;
    const std::string utf8 = utf8_of(character);
    if (is_printable_utf8(utf8)) {
      if (character == U'$' || character == kWideQuote) text += '$';
      text += utf8;
    } else {
      for (const char16_t unit : units.substr(0, count))
        fmt::format_to(std::back_inserter(text), "${:04X}", static_cast<std::uint16_t>(unit));
    }
    units.remove_prefix(count);
  }
  return text + kWideQuote;
}

Result<std::string> parse_characters(std::string_view text) {
  return parse<char>(text);
}

Result<std::u16string> parse_units(std::string_view text) {
  return parse<char16_t>(text);
}

}  // namespace plchost
