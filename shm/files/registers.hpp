#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "shm/base/result.hpp"
#include "shm/files/guarded_mapping.hpp"

namespace plchost {

/// A stretch of a device or file, mapped with the whole pages around it.
struct MappedRegisters {
  GuardedMapping pages;
  std::span<std::byte> bytes;
};
/// `device`: the path of the open `fd`. system: the error of mmap. Set-up.
[[nodiscard]] Result<MappedRegisters> map_registers(int fd, const std::string& device, std::uint64_t address,
                                                    std::uint64_t size);

/// Reads or writes registers in the widest aligned accesses up to 32 bit, each byte once. Real-time.
void copy_from_registers(std::span<std::byte> to, std::span<const std::byte> registers) noexcept;
void copy_to_registers(std::span<std::byte> registers, std::span<const std::byte> from) noexcept;

}  // namespace plchost
