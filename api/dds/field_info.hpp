#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>

namespace plchost::dds {

/// The meaning of a value, by the last part of its member's name.
enum class Unit : std::uint8_t {
  none,
  duration,  ///< nanoseconds
  unix,      ///< CLOCK_REALTIME of the host, ns since 1970; 0: none
};

/// A member of a status topic. visit_fields(sample, visit), which the build makes from control.idl, calls
/// visit(FieldInfo, value) for each of them but epoch, ext and what has parts: values are numbers, texts
/// (string_view) and arrays of octets.
struct FieldInfo {
  std::string_view name;  ///< in control.idl
  std::string_view row;   ///< in the rows of plcctl: the same, if `row:` gives it no other
  std::string_view base;  ///< of the row, without its unit
  Unit unit = Unit::none;
  bool key = false;
  std::span<const std::string_view> words;  ///< for its codes, from 0; empty: it is no code
};

/// The word for a code. A newer host may know more: its number is shown.
[[nodiscard]] inline std::string word_for(std::span<const std::string_view> words, std::uint64_t code) {
  return code < words.size() ? std::string(words[code]) : std::to_string(code);
}

/// How plcctl lists a topic: `list NOUN`. No noun: it does not, or by words of its own.
struct Listing {
  const char* noun = "";
  const char* text = "";
};
template <class Sample>
inline constexpr Listing kListing{};

/// A column of plcctl's tables, as `columns:` has it.
struct ColumnInfo {
  const char* field = "";
  const char* header = "";
  int decimals = 1;
  int rank = 0;  ///< where the table is too wide, the greatest goes first; 0: never
  std::int64_t none = std::numeric_limits<std::int64_t>::min();  ///< this number means that there is none
};
/// Empty: all members are columns.
template <class Sample>
inline constexpr std::array<ColumnInfo, 0> kColumns{};

}  // namespace plchost::dds
