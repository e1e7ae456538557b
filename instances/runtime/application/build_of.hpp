#pragma once

#include <string>

#include "instances/runtime/application/elf_file.hpp"

namespace plchost {

/// How a file of code was built: "GCC: (Debian 12.2.0-14) 12.2.0, build ID 4fd2...". The ID is that by which
/// debuggers find the debug information of a file. Of several compilers the first is told. Empty: the file
/// says nothing. Set-up.
[[nodiscard]] std::string build_of(const ElfFile& file);
/// The same of the file at that path; empty, too: it cannot be read.
[[nodiscard]] std::string build_of(const std::string& path);

}  // namespace plchost
