#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/result.hpp"

namespace plchost {

inline constexpr std::size_t kMaxProgramFile = std::size_t{256} << 20;

/// Checks that `file` is a whole shared object for this machine that exports plc_app_abi with our version and
/// all of `symbols`, before the dynamic loader runs anything of it. The text says what it is instead. Set-up.
[[nodiscard]] Result<void> check_elf(std::span<const std::byte> file,
                                     std::span<const std::string_view> symbols);

/// Checks that a file which check_elf() has passed can be in a process beside another version of itself, and
/// leave it again. It must define no symbol that exists once in a process. unsupported: the text names one.
/// Set-up.
[[nodiscard]] Result<void> check_elf_can_leave(std::span<const std::byte> file);

/// Whether a file that check_elf() has passed can be debugged: it imports plc_debug_declare_pou. Set-up.
[[nodiscard]] Result<bool> is_debug_build(std::span<const std::byte> file);

/// The bytes of a program; the text does not name the path. not_found: no such file. Set-up.
[[nodiscard]] Result<std::vector<std::byte>> read_program(const std::string& path);

/// The same for a file; every text starts with its path. not_found: no such file.
[[nodiscard]] Result<void> check_elf_file(const std::string& path, std::span<const std::string_view> symbols);

}  // namespace plchost
