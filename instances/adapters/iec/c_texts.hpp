#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace plchost::iec {

/// The code that a compiler has written, with the end of each `\x0A` of a text. C takes all hexadecimal
/// digits behind `\x`: `"\x0A1"` becomes `"\x0A""1"`. A text u"..." has four digits. Lines stay as they are.
/// Only texts behind `before`, a number and a comma change, if `before` is not empty.
[[nodiscard]] std::string with_ended_escapes(std::string_view code, std::string_view before = {});

/// Whether names of C, and of Structured Text, have this character.
[[nodiscard]] bool is_of_name(char c) noexcept;
/// Where `wanted` is in C code, outside of parentheses, brackets and quotes; npos: nowhere before they close.
[[nodiscard]] std::size_t find_outside(std::string_view code, std::string_view wanted, std::size_t from = 0);
/// Where the parenthesis or the bracket at `begin` closes; npos: nowhere.
[[nodiscard]] std::size_t find_close(std::string_view code, std::size_t begin);

}  // namespace plchost::iec
