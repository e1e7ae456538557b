#pragma once

#include <chrono>

#include "shm/base/time.hpp"

namespace plchost::modbus {

/// A subject of the log, of which one line a second is enough. One thread.
class LogPause {
 public:
  [[nodiscard]] bool is_over(TimePoint now) noexcept {
    if (now < next_) return false;
    next_ = now + std::chrono::seconds(1);
    return true;
  }

 private:
  TimePoint next_;
};

}  // namespace plchost::modbus
