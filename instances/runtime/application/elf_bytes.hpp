#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>

namespace plchost {

// Every read of an ELF file goes through these two: nothing that the file says about itself is believed.

using ElfBytes = std::span<const std::byte>;

/// A part of the file, or nothing if it does not lie wholly within.
[[nodiscard]] inline std::optional<ElfBytes> elf_slice(ElfBytes file, std::uint64_t offset,
                                                       std::uint64_t size) noexcept {
  if (offset > file.size() || size > file.size() - offset) return std::nullopt;
  return file.subspan(offset, size);
}

/// One entry of a table, or nothing beyond its end.
template <class T>
[[nodiscard]] std::optional<T> elf_item(ElfBytes table, std::uint64_t index) noexcept {
  if (index >= table.size() / sizeof(T)) return std::nullopt;
  T value;
  std::memcpy(&value, table.subspan(index * sizeof(T)).data(), sizeof(T));
  return value;
}

}  // namespace plchost
