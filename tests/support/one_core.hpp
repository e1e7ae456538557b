#pragma once

#include <sched.h>

#include "shm/threads/thread.hpp"

namespace plchost {

/// Binds the calling thread, and all threads that it starts, to one of the cores that it may use, as long as
/// this lives.
class OneCore {
 public:
  OneCore() noexcept {
    CPU_ZERO(&before_);
    const auto cores = allowed_cores(0);
    if (!cores || cores->empty() || ::sched_getaffinity(0, sizeof before_, &before_) != 0) return;
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(static_cast<std::size_t>(cores->back()), &one);
    bound_ = ::sched_setaffinity(0, sizeof one, &one) == 0;
  }
  OneCore(const OneCore&) = delete;
  OneCore& operator=(const OneCore&) = delete;
  ~OneCore() {
    if (bound_) ::sched_setaffinity(0, sizeof before_, &before_);
  }
  [[nodiscard]] bool bound() const noexcept { return bound_; }

 private:
  cpu_set_t before_{};
  bool bound_ = false;
};

}  // namespace plchost
