#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <sys/types.h>

#include "shm/base/result.hpp"
#include "shm/files/locked_byte.hpp"

namespace plchost {

/// Tells nodes whose processes run from those whose processes have ended, in every PID namespace.
///
/// A process locks the byte of each address that it has, in a file beside the directory. One descriptor of
/// that file serves all directories of a process, and nothing else opens it: any close() would give all of
/// the process's locks back. Set-up.
class NodeLocks {
 public:
  /// Makes the file if it is not there. `directory`: the name of the memory.
  [[nodiscard]] static Result<std::shared_ptr<NodeLocks>> open(std::string_view directory);
  /// Only what is there. Null: nothing, or it is not for this user.
  [[nodiscard]] static std::shared_ptr<NodeLocks> find(std::string_view directory);
  static void remove(std::string_view directory) noexcept;
  ~NodeLocks();
  NodeLocks(const NodeLocks&) = delete;
  NodeLocks& operator=(const NodeLocks&) = delete;

  /// Tells the file from one that takes its place. Never 0.
  [[nodiscard]] std::uint32_t file() const noexcept { return static_cast<std::uint32_t>(inode_) | kAFile; }
  /// Also again. False: another process has the address, or the program has closed the file, which has no
  /// name any more.
  [[nodiscard]] bool take(std::uint16_t node) noexcept;
  void give_back(std::uint16_t node) noexcept {
    if (is_open()) unlock_byte(fd_, node);
  }
  /// In doubt it is.
  [[nodiscard]] bool is_taken(std::uint16_t node) const noexcept { return !is_open() || holder(node); }
  /// The process that has the address, for people. Nothing: none has.
  [[nodiscard]] std::optional<ByteHolder> holder(std::uint16_t node) const noexcept {
    return holder_of_byte(fd_, node);
  }

 private:
  static constexpr std::uint32_t kAFile = 1U << 31U;
  NodeLocks(std::string path, int fd, dev_t device, ino_t inode) noexcept
      : path_(std::move(path)), fd_(fd), device_(device), inode_(inode) {}
  [[nodiscard]] static Result<std::shared_ptr<NodeLocks>> open_existing(const std::string& path);
  [[nodiscard]] bool is_open() const noexcept;
  [[nodiscard]] bool is_nameless() const noexcept;
  [[nodiscard]] bool reopen() noexcept;

  const std::string path_;
  std::atomic<int> fd_;
  const dev_t device_;
  const ino_t inode_;
};

}  // namespace plchost
