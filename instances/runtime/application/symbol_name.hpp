#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace plchost {

/// Names places in the code of this process, and keeps the files that it has read for that.
class SymbolNames {
 public:
  /// Where an address lies: "fill(int)+0x12 in bottling.so", or "bottling.so+0x1190" if the file has no
  /// symbol for it; empty: no file is mapped there. Looks into the file's table of symbols, too, so that
  /// functions which it does not export have names. `returned_to`: a call returns to it, so its function is
  /// that of the call before. Set-up.
  [[nodiscard]] std::string at(std::uintptr_t address, bool returned_to = false);

 private:
  const std::vector<char>& contents_of(const char* path);
  std::map<std::string, std::vector<char>, std::less<>> files_;
};

/// `text` with the names of C++ functions in it as they are written in C++: "fill(int)" for "_Z4filli".
/// Set-up.
[[nodiscard]] std::string with_readable_symbols(std::string_view text);

}  // namespace plchost
