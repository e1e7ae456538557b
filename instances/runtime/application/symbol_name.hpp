#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace plchost {

/// Where an address of this process lies: "fill(int)+0x12 in bottling.so", or "bottling.so+0x1190" if the
/// file has no symbol for it; empty: no file is mapped there. Looks into the file's table of symbols, too, so
/// that functions which it does not export have names. Set-up.
[[nodiscard]] std::string symbol_name(std::uintptr_t address);

/// `text` with the names of C++ functions in it as they are written in C++: "fill(int)" for "_Z4filli".
/// Set-up.
[[nodiscard]] std::string with_readable_symbols(std::string_view text);

}  // namespace plchost
