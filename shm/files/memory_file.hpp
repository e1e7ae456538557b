#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/files/guarded_mapping.hpp"
#include "shm/files/memory_rights.hpp"

namespace plchost {

/// A named shared memory, mapped into this process. The name outlives the process; the mapping does not. If
/// others cut its file short, it is zeros from then on in a process that watches for it (see MemoryGuard).
class MemoryFile {
 public:
  static constexpr const char* kDirectory = "/dev/shm";  ///< where all of them lie

  /// Of the file behind a name.
  [[nodiscard]] static std::string path(std::string_view name);

  enum class Access : bool { read_only, read_write };
  /// Writes the first contents. Nobody else sees the memory before it has returned: the name is given last,
  /// and not at all if this fails.
  using Fill = std::function<Result<void>(std::span<std::byte>)>;

  MemoryFile() noexcept = default;

  /// Makes a new one, zero-filled and with its memory really there (a host without memory says so now and not
  /// with SIGBUS in a cycle). Takes the place of an old one of that name, whose users keep their mapping.
  /// `name`: one path component below /dev/shm. A process that ends in here leaves nothing behind.
  [[nodiscard]] static Result<MemoryFile> replace(const std::string& name, std::size_t size,
                                                  const Fill& fill = {}, const MemoryRights& rights = {});

  /// The same, but already_exists if the name is taken.
  [[nodiscard]] static Result<MemoryFile> create(const std::string& name, std::size_t size,
                                                 const Fill& fill = {}, const MemoryRights& rights = {});

  /// Maps an existing one, whole. not_found: no such name. refused: its rights do not allow it, or its owner
  /// is none of those that `owners` allows; the text says whose it is. corrupt: smaller than `at_least`
  /// bytes. wrong_type: not a plain file.
  [[nodiscard]] static Result<MemoryFile> open(const std::string& name, std::size_t at_least, Access access,
                                               const OwnerCheck& owners = is_trusted_owner);

  /// Gives the file of that name `size` bytes if it is empty, as one is that was only just made, or that a
  /// stranger has emptied. not_found: no such name. refused: as open().
  [[nodiscard]] static Result<void> fill_empty(const std::string& name, std::size_t size,
                                               const OwnerCheck& owners = is_trusted_owner);

  /// Removes the name if it is there; processes that have it mapped keep it. False: it is another user's, and
  /// the folder is sticky.
  static bool remove(const std::string& name) noexcept;

  [[nodiscard]] std::span<std::byte> bytes() const noexcept { return mapping_.bytes(); }
  [[nodiscard]] explicit operator bool() const noexcept { return !bytes().empty(); }
  /// False: the process has MemoryGuard::kMost others, and a cut is a SIGBUS in this one. Any context.
  [[nodiscard]] bool guarded() const noexcept { return mapping_.guarded(); }
  /// It was cut short, and its bytes are zeros of this process alone. Any context.
  [[nodiscard]] bool lost() const noexcept { return mapping_.lost(); }
  /// Whether both are one file, made or opened. Two that one after the other had the same name are not.
  [[nodiscard]] bool same_file(const MemoryFile& other) const noexcept {
    return inode_ != 0 && inode_ == other.inode_;
  }

 private:
  friend class UnnamedMemory;
  explicit MemoryFile(GuardedMapping mapping, std::uint64_t inode) noexcept
      : mapping_(std::move(mapping)), inode_(inode) {}
  GuardedMapping mapping_;
  std::uint64_t inode_ = 0;
};

/// A shared memory on its way: nobody else can find it before it has its name.
class UnnamedMemory {
 public:
  [[nodiscard]] static Result<UnnamedMemory> make(const std::string& name, std::size_t size,
                                                  const MemoryRights& rights);
  [[nodiscard]] std::span<std::byte> bytes() const noexcept { return memory_.bytes(); }
  /// See MemoryFile.
  [[nodiscard]] bool guarded() const noexcept { return memory_.guarded(); }
  /// Of the file that has the name: whether this one takes its place.
  using TakeOver = std::function<bool(const std::string& path)>;
  /// already_exists: the name is taken, and `take_over` says no. refused: it is another user's file. A memory
  /// that has lost its name by that is freed when this goes. Once.
  [[nodiscard]] Result<void> give_name(const TakeOver& take_over);
  /// Once it has its name: the same bytes at the same addresses. Once.
  [[nodiscard]] MemoryFile take() noexcept { return std::move(memory_); }

 private:
  UnnamedMemory(std::string path, UniqueFd fd, MemoryFile memory) noexcept
      : path_(std::move(path)), fd_(std::move(fd)), memory_(std::move(memory)) {}
  std::string path_;
  UniqueFd fd_;
  UniqueFd replaced_;
  MemoryFile memory_;
};

/// Takes away what has the name of a shared memory, whatever it is: a folder that is not empty is put aside
/// under another name. It is well if there is nothing. refused: it is another user's, and only that user or
/// root can. Set-up.
[[nodiscard]] Result<void> take_away(const std::string& path);

}  // namespace plchost
