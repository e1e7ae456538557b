#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/unique_fd.hpp"

namespace plchost {

/// An ELF file of 64 bits that is read piece by piece. The process locks its memory and may have little of
/// it, and a file with debug information is large. So only the parts that are asked for are in memory.
/// Nothing that the file says about itself is believed. Set-up.
class ElfFile {
 public:
  struct Section {
    std::string name;
    std::uint32_t type = 0;
    std::uint32_t link = 0;  ///< number of another section, by type
    std::uint64_t offset = 0;
    std::uint64_t size = 0;
    bool plain = false;  ///< it has contents, and they are not compressed
  };

  /// Nothing: it cannot be opened, or is no such file.
  [[nodiscard]] static std::optional<ElfFile> open(const std::string& path);
  [[nodiscard]] static std::optional<ElfFile> of(UniqueFd file);

  /// The first plain section of that name, or of that type; null: there is none. As long as this object.
  [[nodiscard]] const Section* find(std::string_view name) const noexcept;
  [[nodiscard]] const Section* find(std::uint32_t type) const noexcept;
  /// By its number; null: it has none, or no contents.
  [[nodiscard]] const Section* at(std::uint32_t number) const noexcept;
  /// So many bytes of a section from there on: less if it, or the file, ends before.
  [[nodiscard]] std::vector<std::byte> read(const Section& section, std::uint64_t from,
                                            std::size_t size) const;
  /// The text that begins there and ends before a zero; a longer one than 16 KiB is cut.
  [[nodiscard]] std::string text(const Section& section, std::uint64_t from) const;

 private:
  explicit ElfFile(UniqueFd file) : file_(std::move(file)) {}
  [[nodiscard]] std::vector<std::byte> read(std::uint64_t from, std::uint64_t size) const;

  UniqueFd file_;
  std::vector<Section> sections_;
};

}  // namespace plchost
