#pragma once

#include <string>

#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

/// Holds the lock of a file of shared memory, for set-up. The kernel gives it back when the process ends, so
/// nothing in the memory itself can be left locked.
class DirectoryLock {
 public:
  /// `name`: of the file in shared memory. timed_out: another one holds it for seconds.
  [[nodiscard]] static Result<DirectoryLock> acquire(const std::string& name);

 private:
  explicit DirectoryLock(UniqueFd fd) noexcept : fd_(std::move(fd)) {}
  UniqueFd fd_;
};

}  // namespace plchost
