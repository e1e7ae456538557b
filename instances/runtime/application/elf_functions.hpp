#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "instances/runtime/application/elf_file.hpp"

namespace plchost {

/// The function that an address lies in.
struct ElfFunction {
  std::string name;  ///< as the compiler mangles it
  std::uint64_t offset = 0;
};

/// Of each address in the file. Looked up in the full table of symbols, up to 64 MiB of it, which the dynamic
/// loader does not read. So functions that the file does not export are found, too. Reads the table once.
/// Set-up.
[[nodiscard]] std::vector<std::optional<ElfFunction>> functions_at(const ElfFile& file,
                                                                   std::span<const std::uint64_t> addresses);

}  // namespace plchost
