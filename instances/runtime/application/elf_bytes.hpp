#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string_view>

namespace plchost {

// Every read of an ELF file goes through these: nothing that the file says about itself is believed.

using ElfBytes = std::span<const std::byte>;

/// As far as the first zero, or the end.
inline std::string_view text_in(ElfBytes bytes) noexcept {
  const std::string_view all(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return all.substr(0, all.find('\0'));
}

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
