#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>

namespace plchost::dds {

/// No value has this number.
inline constexpr std::int64_t kNoNumber = std::numeric_limits<std::int64_t>::min();

/// The meaning of a value, by the last part of its member's name.
enum class Unit : std::uint8_t {
  none,
  duration,   ///< nanoseconds
  unix,       ///< CLOCK_REALTIME of the host, ns since 1970; 0: none
  unix_text,  ///< the same, in a row that shows it as a text only
};

/// A member of a status topic, or a field of a row of plcctl. The build makes visit_fields(sample, visit)
/// from control.idl. It calls visit(FieldInfo, value) for each member but epoch, ext and those with parts.
/// Values are numbers, texts (string_view) and arrays of octets. visit_row(sample, computed, visit) does so
/// for each field of a row, in its order.
struct FieldInfo {
  std::string_view name;  ///< in control.idl
  std::string_view row;   ///< in the rows of plcctl: the same, if `row:` gives it no other
  std::string_view base;  ///< of the row, without its unit
  Unit unit = Unit::none;
  bool key = false;
  std::span<const std::string_view> words;  ///< for its codes, from 0; empty: it is no code
  std::int64_t null = kNoNumber;            ///< this number means that it is not known
  bool null_if_empty = false;               ///< an empty text means so
};

/// A member with members of its own, of a type that has a row. visit_parts(sample, visit) calls
/// visit(PartInfo, part) for each but sequences. They come in the order of the row.
struct PartInfo {
  std::string_view name;  ///< in control.idl
  std::string_view row;   ///< in the rows of plcctl
  std::string_view text;  ///< its comment
};

/// The fields of a row of `Sample` that plcctl computes: one member for each that `row:` calls computed.
template <class Sample, class Value>
struct Computed {};
/// Whether there is a visit_row() for it.
template <class Sample>
inline constexpr bool kHasRow = false;

/// The code of a word; 0, which says so, if it is none of them.
[[nodiscard]] constexpr std::uint32_t code_for(std::span<const std::string_view> words,
                                               std::string_view word) {
  for (std::uint32_t code = 1; code < words.size(); ++code)
    if (words[code] == word) return code;
  return 0;
}

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
  int rank = 0;                   ///< where the table is too wide, the greatest goes first; 0: never
  std::int64_t none = kNoNumber;  ///< this number means that there is none
};
/// Empty: all members are columns.
template <class Sample>
inline constexpr std::array<ColumnInfo, 0> kColumns{};

}  // namespace plchost::dds
