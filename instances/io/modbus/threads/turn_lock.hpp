#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>

namespace plchost::modbus {

/// A lock that threads get in the order in which they ask for it, so that none that takes it again and again
/// keeps it from the others. A thread that has it may take it once more.
class TurnLock {
 public:
  void lock() {
    std::unique_lock held(mutex_);
    const auto self = std::this_thread::get_id();
    if (depth_ == 0 || holder_ != self) {
      const std::uint64_t number = last_++;
      next_.wait(held, [&] { return depth_ == 0 && served_ == number; });
      holder_ = self;
    }
    ++depth_;
  }
  void unlock() {
    const std::lock_guard held(mutex_);
    if (--depth_ != 0) return;
    ++served_;
    next_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable next_;
  std::uint64_t last_ = 0;    ///< the number of the next thread that asks
  std::uint64_t served_ = 0;  ///< that of the thread that has it, or may take it
  std::thread::id holder_;
  unsigned depth_ = 0;  ///< how often the holder has it
};

}  // namespace plchost::modbus
