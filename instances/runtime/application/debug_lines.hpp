#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "instances/runtime/application/elf_file.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// A line of a source.
struct SourceLine {
  std::string file;        ///< its name, without folders: those are of the machine that has compiled it
  std::uint64_t line = 0;  ///< from 1; 0: not known
};

/// The lines that addresses in the file come from, one for each address: by its section .debug_line (DWARF 2
/// to 5, as the compiler's -g makes it). A function that the compiler has put into another one has its own
/// line. Not known: the file has no such section, it is compressed, or a part of it is larger than 4 MiB or
/// lies beyond 64 MiB. Reads each part once for all addresses, and none any more at `deadline`. Set-up.
[[nodiscard]] std::vector<SourceLine> source_lines(const ElfFile& file,
                                                   std::span<const std::uint64_t> addresses,
                                                   TimePoint deadline = TimePoint::max());

}  // namespace plchost
