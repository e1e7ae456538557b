#pragma once

#include <cstdint>
#include <string>

#include <fmt/format.h>

#include "shm/pool/memory_file.hpp"

namespace plchost {

/// How a page tells what it is, in the first fields of its layout.
struct PageKind {
  const char* what;  ///< for errors: "host page"
  std::uint64_t magic;
  std::uint32_t version;
};

/// Opens a page whose layout has one size and begins with magic, version and size. not_found. corrupt: it is
/// something else, or of another version; says what was found and what is needed.
template <class Layout>
[[nodiscard]] Result<MemoryFile> open_fixed_page(const std::string& name, const PageKind& kind,
                                                 MemoryFile::Access access) {
  auto memory = MemoryFile::open(name, sizeof(Layout), access);
  if (!memory) return memory;
  const Layout& page = *reinterpret_cast<const Layout*>(memory->bytes().data());
  // The name is given to complete pages only, so the magic is there from the start.
  if (page.magic != kind.magic) {
    return failure(ErrorCode::corrupt, fmt::format("shared memory '{}' is not a {}", name, kind.what));
  }
  if (page.version != kind.version || page.size != sizeof(Layout) ||
      memory->bytes().size() != sizeof(Layout)) {
    return failure(ErrorCode::corrupt,
                   fmt::format("{} '{}' has version {} and {} bytes; {} and {} are needed", kind.what, name,
                               page.version, memory->bytes().size(), kind.version, sizeof(Layout)));
  }
  return memory;
}

}  // namespace plchost
