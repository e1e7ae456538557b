#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>

#include "shm/base/result.hpp"

namespace plchost {

/// A named shared memory, mapped into this process. The name outlives the process; the mapping does not.
class MemoryFile {
 public:
  static constexpr const char* kDirectory = "/dev/shm";  ///< where all of them lie

  enum class Access : bool { read_only, read_write };
  /// Writes the first contents. Nobody else sees the memory before it has returned: the name is given last,
  /// and not at all if this fails.
  using Fill = std::function<Result<void>(std::span<std::byte>)>;

  MemoryFile() noexcept = default;
  MemoryFile(MemoryFile&& other) noexcept;
  MemoryFile& operator=(MemoryFile&& other) noexcept;
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile();

  /// Makes a new one, zero-filled and with its memory really there (a host without memory says so now and not
  /// with SIGBUS in a cycle). Takes the place of an old one of that name, whose users keep their mapping.
  /// `name`: one path component below /dev/shm. Mode 0660 whatever the umask. A process that dies in here
  /// leaves nothing behind.
  [[nodiscard]] static Result<MemoryFile> replace(const std::string& name, std::size_t size,
                                                  const Fill& fill = {});

  /// The same, but already_exists if the name is taken.
  [[nodiscard]] static Result<MemoryFile> create(const std::string& name, std::size_t size,
                                                 const Fill& fill = {});

  /// Maps an existing one, whole. not_found: no such name. corrupt: smaller than `at_least` bytes, or not a
  /// plain file.
  [[nodiscard]] static Result<MemoryFile> open(const std::string& name, std::size_t at_least, Access access);

  /// Gives the file of that name `size` bytes if it is empty, as one is that was only just made, or that a
  /// stranger has emptied. not_found: no such name.
  [[nodiscard]] static Result<void> fill_empty(const std::string& name, std::size_t size);

  /// Removes the name if it is there; who has it mapped keeps it.
  static void remove(const std::string& name) noexcept;

  [[nodiscard]] std::span<std::byte> bytes() const noexcept { return bytes_; }
  [[nodiscard]] explicit operator bool() const noexcept { return !bytes_.empty(); }

 private:
  static Result<MemoryFile> make(const std::string& name, std::size_t size, const Fill& fill, bool take_over);
  explicit MemoryFile(std::span<std::byte> bytes) noexcept : bytes_(bytes) {}
  std::span<std::byte> bytes_;
};

}  // namespace plchost
