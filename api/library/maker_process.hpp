#pragma once

#include <unistd.h>

#include "shm/base/result.hpp"

namespace plchost {

/// The process that made something. After fork() the child has all that was in memory and none of its
/// threads: it can neither use that nor wait for it.
class MakerProcess {
 public:
  [[nodiscard]] bool is_this() const noexcept { return pid_ == ::getpid(); }
  /// unavailable: it is another one.
  [[nodiscard]] Result<void> check() const {
    if (is_this()) return {};
    return failure(ErrorCode::unavailable,
                   "the client was made before fork(): make another one in the child");
  }

 private:
  pid_t pid_ = ::getpid();
};

}  // namespace plchost
