#pragma once

#include <string>
#include <string_view>

#include "shm/base/result.hpp"

namespace plchost {

// Texts of characters as Structured Text writes them: bytes in ', units of UTF-16 in ".

inline constexpr char kQuote = '\'';
inline constexpr char kWideQuote = '"';

/// With $ before ' and $, and $hh for bytes that are not printable. UTF-8 stays as it is.
[[nodiscard]] std::string string_text(std::string_view characters);
/// In UTF-8, with $ before " and $, and $hhhh for units that are not printable or half of a pair.
[[nodiscard]] std::string string_text(std::u16string_view units);

/// The bytes of such a text, or of one that does not begin with '. invalid_argument: says what is allowed.
[[nodiscard]] Result<std::string> parse_characters(std::string_view text);
/// The units of such a text, or of one in UTF-8 that does not begin with ". invalid_argument: the same.
[[nodiscard]] Result<std::u16string> parse_units(std::string_view text);

}  // namespace plchost
