#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "shm/base/result.hpp"

namespace plchost {

/// The types of variables: PLC_TYPE_... of instances/plc_variables.h.
enum class VariableType : std::uint8_t {
  bool_ = 1,  // NOLINT(readability-identifier-naming): a keyword
  sint,
  int_,  // NOLINT(readability-identifier-naming): a keyword
  dint,
  lint,
  usint,
  uint,
  udint,
  ulint,
  byte,
  word,
  dword,
  lword,
  real,
  lreal,
  time,
  date,
  time_of_day,
  date_and_time,
  string,
  timespec_time,
  timespec_date,
  timespec_time_of_day,
  timespec_date_and_time,
  counted_string,
  sized_string,
  days_date,
  char_,  // NOLINT(readability-identifier-naming): a keyword
  wchar,
  wstring,
  sized_wstring,
};

/// A row of the table of types.
struct VariableTypeTraits {
  VariableType type{};
  std::string_view name;    ///< of IEC 61131-3: "INT"; layouts of one IEC type have the same
  std::uint32_t bytes = 0;  ///< of a value; 0: of a string, each variable has its own
};
[[nodiscard]] std::span<const VariableTypeTraits> variable_types() noexcept;
/// Null: no such number.
[[nodiscard]] const VariableTypeTraits* find_variable_type(std::uint32_t number) noexcept;
[[nodiscard]] const VariableTypeTraits& traits_of(VariableType type) noexcept;
[[nodiscard]] bool is_string(VariableType type) noexcept;
/// Of units of UTF-16: WCHAR, WSTRING.
[[nodiscard]] bool is_wide(VariableType type) noexcept;
/// The most bytes, or units of UTF-16, that a string with so many bytes of memory takes.
[[nodiscard]] std::size_t string_room(VariableType type, std::size_t bytes) noexcept;

/// A value as text, as Structured Text writes it. BOOL: TRUE. Integers: -12. BYTE to LWORD: 16#00FF.
/// REAL: 1.5. Times: T#1s500ms, D#2026-11-25, TOD#12:30:00, DT#2026-11-25-12:30:00. STRING: 'text' with $
/// before ' and $, and $hh for bytes that are not printable. CHAR: 'x'. WSTRING, WCHAR: "text" in UTF-8, with
/// $ before " and $, and $hhhh for units of UTF-16 that are not printable. The bytes are those of the
/// variable: `value.size()` is that of its type, or the string's memory. Any bytes are allowed. A time that
/// is out of its range is shown as its number. At most `most` bytes; a longer text is cut and ends in "...".
[[nodiscard]] std::string variable_text(VariableType type, std::span<const std::byte> value,
                                        std::size_t most = 255);

/// The bytes of a text, into `value`, whose size is that of the type or the string's memory. Allowed is what
/// variable_text() writes, also without the type's prefix, and integers in each base of IEC 61131-3 (2#, 8#,
/// 16#, with _ between digits). TRUE, FALSE, 1, 0 of a BOOL, in any case. A text without quotes is a STRING
/// or WSTRING, too. invalid_argument: says what is allowed, with the range. `value` is unchanged then.
[[nodiscard]] Result<void> parse_variable(VariableType type, std::string_view text,
                                          std::span<std::byte> value);

}  // namespace plchost
