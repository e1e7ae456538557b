#pragma once

#include <string>
#include <string_view>

namespace plchost::iec {

/// The code that a compiler has written, with the end of each `\x0A` of a text. C takes all hexadecimal
/// digits behind `\x`: `"\x0A1"` becomes `"\x0A""1"`. A text u"..." has four digits. Lines stay as they are.
/// Only texts behind `before`, a number and a comma change, if `before` is not empty.
[[nodiscard]] std::string with_ended_escapes(std::string_view code, std::string_view before = {});

}  // namespace plchost::iec
