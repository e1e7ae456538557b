#pragma once

#include <string>
#include <utility>

#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

/// A file that one process at a time holds. The kernel lets go of it however the process ends. A child of
/// fork() does not hold it. The process itself must not open the file a second time: closing that would let
/// go of the lock.
class LockFile {
 public:
  /// Makes the file if it is not there. already_exists: another process holds it; the text says which.
  /// refused: it belongs to another user than root and this one, others may write it, or it is no plain file.
  /// Set-up.
  [[nodiscard]] static Result<LockFile> take(const std::string& path);
  /// Removes the file, still holding the lock.
  void remove() noexcept;

 private:
  LockFile(UniqueFd fd, std::string path) : fd_(std::move(fd)), path_(std::move(path)) {}
  UniqueFd fd_;
  std::string path_;
};

}  // namespace plchost
