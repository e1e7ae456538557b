#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <string>
#include <type_traits>

#include <fmt/format.h>

#include "shm/files/memory_file.hpp"
#include "shm/files/open_or_make.hpp"

namespace plchost {

/// How a page tells what it is: by the first fields of its layout, `magic` (64 bits) and `version` (32 bits),
/// and by its own length in `size`.
struct PageKind {
  const char* what;  ///< for errors: "host page"
  std::uint64_t magic;
  std::uint32_t version;
};

/// Whether the page says that it is of this kind and of `size` bytes: as describe_page() has left it.
template <class Layout>
[[nodiscard]] bool is_described(const Layout& page, const PageKind& kind,
                                std::size_t size = sizeof(Layout)) noexcept {
  return page.magic == kind.magic && page.version == kind.version && page.size == size;
}

/// Opens a page whose layout begins with magic and version, and checks the magic. Of open_page().
template <class Layout>
[[nodiscard]] Result<MemoryFile> open_of_magic(const std::string& name, const PageKind& kind,
                                               MemoryFile::Access access,
                                               const OwnerCheck& owners = is_trusted_owner) {
  static_assert(offsetof(Layout, magic) == 0 && offsetof(Layout, version) == 8);
  auto memory = MemoryFile::open(name, sizeof(Layout), access, owners);
  if (!memory) return memory;
  // The name is given to complete pages only, so the magic is there from the start.
  if (reinterpret_cast<const Layout*>(memory->bytes().data())->magic == kind.magic) return memory;
  return failure(ErrorCode::corrupt, fmt::format("shared memory '{}' is not a {}", name, kind.what));
}

/// Opens a page that may be longer than its layout; its length is for the caller to check. not_found,
/// refused, wrong_type: as MemoryFile::open(). corrupt: it is something else, or of another version; says
/// what was found and what is needed.
template <class Layout>
[[nodiscard]] Result<MemoryFile> open_page(const std::string& name, const PageKind& kind,
                                           MemoryFile::Access access) {
  auto memory = open_of_magic<Layout>(name, kind, access);
  if (!memory) return memory;
  const std::uint32_t version = reinterpret_cast<const Layout*>(memory->bytes().data())->version;
  if (version == kind.version) return memory;
  return failure(ErrorCode::corrupt, fmt::format("{} '{}' has version {}; version {} is needed", kind.what,
                                                 name, version, kind.version));
}

/// The same of a layout that has one size and says it in `size`.
template <class Layout>
[[nodiscard]] Result<MemoryFile> open_fixed_page(const std::string& name, const PageKind& kind,
                                                 MemoryFile::Access access,
                                                 const OwnerCheck& owners = is_trusted_owner) {
  auto memory = open_of_magic<Layout>(name, kind, access, owners);
  if (!memory) return memory;
  const Layout& page = *reinterpret_cast<const Layout*>(memory->bytes().data());
  if (!is_described(page, kind) || memory->bytes().size() != sizeof(Layout)) {
    return failure(ErrorCode::corrupt,
                   fmt::format("{} '{}' has version {} and {} bytes; {} and {} are needed", kind.what, name,
                               page.version, memory->bytes().size(), kind.version, sizeof(Layout)));
  }
  return memory;
}

/// Writes what the page says of itself: the magic last.
template <class Layout>
void describe_page(Layout& page, const PageKind& kind, std::size_t size = sizeof(Layout)) noexcept {
  page.version = kind.version;
  page.size = static_cast<decltype(page.size)>(size);
  std::atomic_signal_fence(std::memory_order_release);  // a kill sees the order of the program
  page.magic = kind.magic;
}

/// An empty page needs nothing more.
template <class Layout>
void leave_empty(Layout& /*page*/) noexcept {}

/// For MemoryFile: an empty page of that kind, as `begin` leaves it.
template <class Layout, class Begin = void (*)(Layout&)>
[[nodiscard]] MemoryFile::Fill new_page(const PageKind& kind, Begin begin = leave_empty<Layout>) {
  return [&kind, begin](std::span<std::byte> bytes) -> Result<void> {
    auto& page = *new (bytes.data()) Layout();
    begin(page);
    describe_page(page, kind);
    return {};
  };
}

/// The owners that a page may have, and the rights to one that is made.
struct PageRights {
  OwnerCheck owners = is_trusted_owner;
  MemoryRights memory = {};
};
/// Of a page that the manager alone writes: no instance has it by its user or its group.
inline PageRights managers_page() {
  return {.owners = is_own_or_roots, .memory = {.mode = 0640}};
}

/// Opens the page of that name, or makes a new one, to write to it. `kind` is a constant of the program.
template <class Layout, class Begin = void (*)(Layout&)>
[[nodiscard]] Result<MemoryFile> open_or_make_page(const std::string& name, const PageKind& kind,
                                                   Replaces replaces, Begin begin = leave_empty<Layout>,
                                                   const PageRights& rights = {}) {
  const auto make = [&](bool replace) {
    const auto fill = new_page<Layout>(kind, begin);
    return replace ? MemoryFile::replace(name, sizeof(Layout), fill, rights.memory)
                   : MemoryFile::create(name, sizeof(Layout), fill, rights.memory);
  };
  return open_or_make(
      [&] { return open_fixed_page<Layout>(name, kind, MemoryFile::Access::read_write, rights.owners); },
      make, replaces);
}

}  // namespace plchost
