#include "shm/variables/variable_type.hpp"

#include <algorithm>
#include <charconv>
#include <concepts>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <limits>
#include <type_traits>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/variables/string_text.hpp"
#include "shm/variables/time_text.hpp"
#include "shm/variables/variable_symbol.hpp"

namespace plchost {

namespace {

using enum VariableType;

// In the order of their numbers, from 1.
constexpr std::array<VariableTypeTraits, 31> kTypes{{{bool_, "BOOL", 1},
                                                     {sint, "SINT", 1},
                                                     {int_, "INT", 2},
                                                     {dint, "DINT", 4},
                                                     {lint, "LINT", 8},
                                                     {usint, "USINT", 1},
                                                     {uint, "UINT", 2},
                                                     {udint, "UDINT", 4},
                                                     {ulint, "ULINT", 8},
                                                     {byte, "BYTE", 1},
                                                     {word, "WORD", 2},
                                                     {dword, "DWORD", 4},
                                                     {lword, "LWORD", 8},
                                                     {real, "REAL", 4},
                                                     {lreal, "LREAL", 8},
                                                     {time, "TIME", 8},
                                                     {date, "DATE", 8},
                                                     {time_of_day, "TOD", 8},
                                                     {date_and_time, "DT", 8},
                                                     {string, "STRING", 0},
                                                     {timespec_time, "TIME", 16},
                                                     {timespec_date, "DATE", 16},
                                                     {timespec_time_of_day, "TOD", 16},
                                                     {timespec_date_and_time, "DT", 16},
                                                     {counted_string, "STRING", 0},
                                                     {sized_string, "STRING", 0},
                                                     {days_date, "DATE", 8},
                                                     {char_, "CHAR", 1},
                                                     {wchar, "WCHAR", 2},
                                                     {wstring, "WSTRING", 0},
                                                     {sized_wstring, "WSTRING", 0}}};
constexpr std::int64_t kPerSecond = 1'000'000'000;
constexpr std::int64_t kPerDay = 86'400 * kPerSecond;
/// Behind the characters of a sized_string and sized_wstring: its length. Before it may be a byte that is no
/// character.
using StringLength = std::uint16_t;
constexpr std::size_t kMinSized = 2 + sizeof(StringLength);
constexpr std::size_t kUnit = sizeof(char16_t);
constexpr std::size_t kMaxCounted = 255;

std::unexpected<Error> not_allowed(std::string_view text, std::string_view allowed) {
  return failure(ErrorCode::invalid_argument,
                 fmt::format("'{}' is not allowed here; allowed is {}", shown(text), allowed));
}

std::unexpected<Error> not_of(VariableType type, std::string_view text, std::string_view allowed) {
  return failure(ErrorCode::invalid_argument,
                 fmt::format("'{}' is no {}; allowed is {}", shown(text), traits_of(type).name, allowed));
}

template <class Value>
Value load(std::span<const std::byte> bytes) noexcept {
  Value value{};
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

template <class Value>
void store(std::span<std::byte> bytes, Value value) noexcept {
  std::memcpy(bytes.data(), &value, sizeof value);
}

/// Calls `with` with a value of the C++ type that an integer or bit string has.
template <class With>
auto with_integer(VariableType type, With with) {
  const bool has_sign = type >= sint && type <= lint;
  switch (traits_of(type).bytes) {
    case 1:
      return has_sign ? with(std::int8_t{}) : with(std::uint8_t{});
    case 2:
      return has_sign ? with(std::int16_t{}) : with(std::uint16_t{});
    case 4:
      return has_sign ? with(std::int32_t{}) : with(std::uint32_t{});
    default:
      return has_sign ? with(std::int64_t{}) : with(std::uint64_t{});
  }
}

bool is_bit_string(VariableType type) noexcept {
  return type >= byte && type <= lword;
}

/// For types of time; nothing: of another type.
std::optional<TimeForm> form_of(VariableType type) noexcept {
  if (type >= time && type <= date_and_time)
    return static_cast<TimeForm>(std::to_underlying(type) - std::to_underlying(time));
  if (type >= timespec_time && type <= timespec_date_and_time)
    return static_cast<TimeForm>(std::to_underlying(type) - std::to_underlying(timespec_time));
  return std::nullopt;
}

// ---- to text

template <class Value>
std::string real_text(Value value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".n") != std::string::npos) return text;  // also nan, inf
  text.insert(std::min(text.find('e'), text.size()), ".0");
  return text;
}

std::string days_text(std::int64_t days) {
  std::int64_t nanoseconds = 0;
  return __builtin_mul_overflow(days, kPerDay, &nanoseconds) ? fmt::format("{}", days)
                                                             : time_text(TimeForm::date, nanoseconds);
}

std::string timespec_text(TimeForm form, std::int64_t seconds, std::int64_t nanoseconds) {
  std::int64_t sum = 0;
  if (__builtin_mul_overflow(seconds, kPerSecond, &sum) || __builtin_add_overflow(sum, nanoseconds, &sum))
    return fmt::format("{} s {} ns", seconds, nanoseconds);
  return time_text(form, sum);
}

/// The characters that a string's memory holds.
std::string_view characters_of(VariableType type, std::span<const std::byte> value) noexcept {
  const auto* const bytes = reinterpret_cast<const char*>(value.data());
  if (value.empty()) return {};
  if (type == counted_string)
    return {bytes + 1, std::min<std::size_t>(std::to_integer<std::size_t>(value[0]), value.size() - 1)};
  if (type == sized_string) {
    if (value.size() < kMinSized) return {};
    const std::size_t room = value.size() - sizeof(StringLength);
    return {bytes, std::min<std::size_t>(load<StringLength>(value.subspan(room)), room - 1)};
  }
  return {bytes, static_cast<std::size_t>(std::find(bytes, bytes + value.size(), '\0') - bytes)};
}

/// The units of UTF-16 that a string's memory holds.
std::u16string units_of(VariableType type, std::span<const std::byte> value) {
  std::u16string units;
  std::size_t count = value.size() / kUnit;
  if (type == sized_wstring) {
    const std::size_t room = string_room(type, value.size());
    if (room == 0) return units;
    count = std::min<std::size_t>(load<StringLength>(value.last(sizeof(StringLength))), room);
  }
  units.resize(count);
  if (count != 0) std::memcpy(units.data(), value.data(), count * kUnit);
  if (type == wstring) units.resize(std::min(units.find(u'\0'), count));
  return units;
}

std::string whole_string(VariableType type, std::span<const std::byte> value) {
  return is_wide(type) ? string_text(units_of(type, value)) : string_text(characters_of(type, value));
}

std::string whole_text(VariableType type, std::span<const std::byte> value) {
  if (is_string(type)) return whole_string(type, value);
  if (value.size() < traits_of(type).bytes) return {};
  if (type == char_) return string_text(std::string_view(reinterpret_cast<const char*>(value.data()), 1));
  if (type == wchar) return string_text(std::u16string(1, load<char16_t>(value)));
  if (type == bool_) return value[0] == std::byte{0} ? "FALSE" : "TRUE";
  if (type == real) return real_text(load<float>(value));
  if (type == lreal) return real_text(load<double>(value));
  if (type == days_date) return days_text(load<std::int64_t>(value));
  if (const auto form = form_of(type)) {
    if (type < timespec_time) return time_text(*form, load<std::int64_t>(value));
    return timespec_text(*form, load<std::int64_t>(value), load<std::int64_t>(value.subspan(8)));
  }
  return with_integer(type, [&]<class Value>(Value) {
    const auto number = load<Value>(value);
    return is_bit_string(type) ? fmt::format("16#{:0{}X}", number, 2 * sizeof number)
                               : fmt::format("{}", number);
  });
}

// ---- from text

/// The rest of "PREFIX#rest", for a prefix that a literal of the type can have; else the text.
std::string_view without_prefix(VariableType type, std::string_view text) {
  const std::size_t sharp = text.find('#');
  if (sharp == std::string_view::npos) return text;
  struct Names {
    std::string_view type;
    std::array<std::string_view, 4> prefixes;
  };
  constexpr std::array<Names, 4> kPrefixes{{{"TIME", {"T", "TIME", "LT", "LTIME"}},
                                            {"DATE", {"D", "DATE", "LD", "LDATE"}},
                                            {"TOD", {"TOD", "TIME_OF_DAY", "LTOD", "LTIME_OF_DAY"}},
                                            {"DT", {"DT", "DATE_AND_TIME", "LDT", "LDATE_AND_TIME"}}}};
  const std::string_view name = traits_of(type).name;
  const std::string_view prefix = text.substr(0, sharp);
  bool known = same_variable_name(prefix, name);
  for (const Names& names : kPrefixes) {
    known = known || (names.type == name && std::ranges::any_of(names.prefixes, [&](std::string_view each) {
                        return same_variable_name(prefix, each);
                      }));
  }
  return known ? text.substr(sharp + 1) : text;
}

/// Digits without the _ between them; nothing: there is a _ that is not between two.
std::optional<std::string> plain_digits(std::string_view text) {
  std::string digits;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '_') {
      digits += text[i];
    } else if (i == 0 || i + 1 == text.size() || !std::isxdigit(static_cast<unsigned char>(text[i - 1])) ||
               !std::isxdigit(static_cast<unsigned char>(text[i + 1]))) {
      return std::nullopt;
    }
  }
  return digits;
}

template <class Value>
std::optional<Value> integer_of(std::string_view text) {
  int base = 10;
  const std::size_t sharp = text.find('#');
  if (sharp != std::string_view::npos) {
    const std::string_view name = text.substr(0, sharp);
    base = name == "2" ? 2 : name == "8" ? 8 : name == "10" ? 10 : name == "16" ? 16 : 0;
    text.remove_prefix(sharp + 1);
    if (base == 0 || text.starts_with('-')) return std::nullopt;
  } else if (text.size() > 1 && text.starts_with('+') && text[1] != '-') {
    text.remove_prefix(1);
  }
  const auto digits = plain_digits(text);
  if (!digits) return std::nullopt;
  Value value{};
  const auto [end, error] = std::from_chars(digits->data(), digits->data() + digits->size(), value, base);
  if (error != std::errc() || end != digits->data() + digits->size()) return std::nullopt;
  return value;
}

Result<void> parse_integer(VariableType type, std::string_view text, std::span<std::byte> value) {
  return with_integer(type, [&]<class Value>(Value) -> Result<void> {
    const auto number = integer_of<Value>(text);
    if (number) {
      store(value, *number);
      return {};
    }
    using Limits = std::numeric_limits<Value>;
    if (is_bit_string(type)) {
      return not_of(type, text, fmt::format("0 to 16#{:X}, in base 10, 2#, 8# or 16#", Limits::max()));
    }
    return not_of(type, text,
                  fmt::format("{} to {}, in base 10, 2#, 8# or 16#", Limits::min(), Limits::max()));
  });
}

template <class Value>
Result<void> parse_real(VariableType type, std::string_view text, std::span<std::byte> value) {
  const auto digits = plain_digits(text.starts_with('+') ? text.substr(1) : text);
  Value number{};
  const char* const begin = digits ? digits->data() : nullptr;
  const char* const end = digits ? begin + digits->size() : nullptr;
  if (digits && !(text.starts_with('+') && digits->starts_with('-'))) {
    const auto [stop, error] = std::from_chars(begin, end, number);
    if (error == std::errc() && stop == end && begin != end) {
      store(value, number);
      return {};
    }
  }
  return not_of(type, text,
                fmt::format("1.5, -2.0e-3, nan, or up to {:.3g}", std::numeric_limits<Value>::max()));
}

Result<void> parse_bool(std::string_view text, std::span<std::byte> value) {
  const bool on = text == "1" || same_variable_name(text, "TRUE");
  if (!on && text != "0" && !same_variable_name(text, "FALSE"))
    return not_of(bool_, text, "TRUE, FALSE, 1, 0");
  value[0] = std::byte{on ? std::uint8_t{1} : std::uint8_t{0}};
  return {};
}

Result<void> parse_moment(VariableType type, TimeForm form, std::string_view text,
                          std::span<std::byte> value) {
  PLCHOST_TRY_ASSIGN(const std::int64_t nanoseconds, parse_time(form, text));
  if (type == days_date) {
    store(value, nanoseconds / kPerDay);  // a date is a whole number of them
  } else if (type < timespec_time) {
    store(value, nanoseconds);
  } else {
    const auto [seconds, rest] = std::lldiv(nanoseconds, kPerSecond);
    store(value, std::int64_t{seconds});
    store(value.subspan(8), std::int64_t{rest});
  }
  return {};
}

/// With quotes: without them one letter could be the name of a variable as well.
Result<void> parse_character(VariableType type, std::string_view text, std::span<std::byte> value) {
  const char quote = is_wide(type) ? kWideQuote : kQuote;
  const auto refused = [&] {
    return not_of(type, text,
                  is_wide(type) ? "one unit of UTF-16, as \"x\" or \"$0041\"" : "one byte, as 'x' or '$41'");
  };
  if (!text.starts_with(quote)) return refused();
  if (is_wide(type)) {
    PLCHOST_TRY_ASSIGN(const std::u16string units, parse_units(text));
    if (units.size() != 1) return refused();
    store(value, units.front());
  } else {
    PLCHOST_TRY_ASSIGN(const std::string characters, parse_characters(text));
    if (characters.size() != 1) return refused();
    store(value, characters.front());
  }
  return {};
}

/// `characters` of a type, which have room in the memory of `value`.
template <class Character>
Result<void> put_string(VariableType type, std::string_view text,
                        const std::basic_string<Character>& characters, std::span<std::byte> value) {
  constexpr bool kIsWide = sizeof(Character) > 1;
  const bool counted = type == counted_string;
  const std::size_t most = string_room(type, value.size());
  if (characters.size() > most)
    return not_allowed(text, fmt::format("a text of at most {} {}; this one has {}", most,
                                         kIsWide ? "units of UTF-16" : "bytes", characters.size()));
  if (value.empty()) return {};
  if (!counted && characters.find(Character{}) != std::basic_string<Character>::npos)
    return not_allowed(text, fmt::format("a text without ${:0{}}, which ends a {}", 0, 2 * sizeof(Character),
                                         traits_of(type).name));
  std::ranges::fill(value, std::byte{0});
  if (counted) value[0] = static_cast<std::byte>(characters.size());
  std::memcpy(value.data() + (counted ? 1 : 0), characters.data(), characters.size() * sizeof(Character));
  const bool sized = type == sized_string || type == sized_wstring;
  if (sized && value.size() >= kMinSized)
    store(value.last(sizeof(StringLength)), static_cast<StringLength>(characters.size()));
  return {};
}

Result<void> parse_string(VariableType type, std::string_view text, std::span<std::byte> value) {
  const char quote = is_wide(type) ? kWideQuote : kQuote;
  if (const auto rest = without_prefix(type, text); rest.starts_with(quote)) text = rest;
  if (is_wide(type)) {
    PLCHOST_TRY_ASSIGN(const std::u16string units, parse_units(text));
    return put_string(type, text, units, value);
  }
  PLCHOST_TRY_ASSIGN(const std::string characters, parse_characters(text));
  return put_string(type, text, characters, value);
}

}  // namespace

std::span<const VariableTypeTraits> variable_types() noexcept {
  return kTypes;
}

const VariableTypeTraits* find_variable_type(std::uint32_t number) noexcept {
  return number >= 1 && number <= kTypes.size() ? &kTypes[number - 1] : nullptr;
}

const VariableTypeTraits& traits_of(VariableType type) noexcept {
  return kTypes[static_cast<std::size_t>(std::to_underlying(type)) - 1];
}

bool is_string(VariableType type) noexcept {
  return traits_of(type).bytes == 0;
}

bool is_wide(VariableType type) noexcept {
  return type >= wchar && type <= sized_wstring;
}

std::size_t string_room(VariableType type, std::size_t bytes) noexcept {
  if (bytes == 0) return 0;
  if (type == counted_string) return std::min(bytes - 1, kMaxCounted);
  if (type == sized_string) return bytes < kMinSized ? 0 : bytes - kMinSized;
  if (type == sized_wstring) return bytes < kMinSized ? 0 : (bytes - kMinSized) / kUnit;
  if (type == wstring) return bytes < kUnit ? 0 : bytes / kUnit - 1;
  return bytes - 1;
}

std::string variable_text(VariableType type, std::span<const std::byte> value, std::size_t most) {
  return shortened(whole_text(type, value), most);
}

Result<void> parse_variable(VariableType type, std::string_view text, std::span<std::byte> value) {
  if (is_string(type)) return parse_string(type, text, value);
  if (value.size() != traits_of(type).bytes) {
    return failure(ErrorCode::wrong_size, fmt::format("a {} has {} bytes and not {}", traits_of(type).name,
                                                      traits_of(type).bytes, value.size()));
  }
  const std::string_view literal = without_prefix(type, text);
  if (type == bool_) return parse_bool(literal, value);
  if (type == char_ || type == wchar) return parse_character(type, literal, value);
  if (type == real) return parse_real<float>(type, literal, value);
  if (type == lreal) return parse_real<double>(type, literal, value);
  if (type == days_date) return parse_moment(type, TimeForm::date, literal, value);
  if (const auto form = form_of(type)) return parse_moment(type, *form, literal, value);
  return parse_integer(type, literal, value);
}

}  // namespace plchost
