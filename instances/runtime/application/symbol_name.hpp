#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/time.hpp"

namespace plchost {

/// A place in the code of this process.
struct CodePlace {
  std::uintptr_t address = 0;
  bool returned_to = false;  ///< a call returns to it, so its function and line are those of the call before
};

/// Where each place lies: "fill(int)+0x12 in bottling.so at bottling.cpp:41". Without the line, if the file
/// has no debug information: see source_lines(). "bottling.so+0x1190" if it has no symbol for the place;
/// empty: no file is mapped there. Looks into the file's table of symbols, too (up to 64 MiB of it), so that
/// functions which it does not export have names. Set-up.
///
/// Each file is read once for all its places, and piece by piece. It is read here, in the process that runs
/// its code: so the author of a file that misleads this reader gains nothing by it.
///
/// At `deadline` no more of a file is read: then the names are those that it exports, or lines are missing.
[[nodiscard]] std::vector<std::string> names_of(std::span<const CodePlace> places,
                                                TimePoint deadline = TimePoint::max());
/// Of one place, which is no return address.
[[nodiscard]] std::string name_of(std::uintptr_t address);

/// `text` with the names of C++ functions in it as they are written in C++: "fill(int)" for "_Z4filli".
/// Set-up.
[[nodiscard]] std::string with_readable_symbols(std::string_view text);

}  // namespace plchost
