#pragma once

#include <string>
#include <string_view>

namespace plchost::matiec {

/// The C code of iec2c, in which NOT of bit strings has the type of its operand, as in IEC 61131-3. By itself
/// it has 32 bits in an expression: `(NOT b) = BYTE#16#F0` is FALSE for each `b`.
[[nodiscard]] std::string with_narrow_complements(std::string_view code);

}  // namespace plchost::matiec
