#pragma once

#include <string>

#include <time.h>

#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

/// The system calls of HostClock: tests have clocks of their own. Soft threads.
class ClockSystem {
 public:
  virtual ~ClockSystem() = default;
  /// clock_gettime(). 0, or errno.
  [[nodiscard]] virtual int time(clockid_t clock, timespec& to) noexcept = 0;
  /// How many seconds CLOCK_TAI is ahead of CLOCK_REALTIME. 0: nobody has told the kernel.
  [[nodiscard]] virtual int tai_offset() noexcept = 0;
  /// Opens the clock device for reading. wrong_type: it is no PTP clock, and was not opened. unavailable.
  [[nodiscard]] virtual Result<UniqueFd> open(const std::string& path) = 0;
  /// ioctl(). 0, or errno.
  [[nodiscard]] virtual int control(int device, unsigned long request, void* argument) noexcept = 0;
};

/// That of Linux.
[[nodiscard]] ClockSystem& linux_clock_system() noexcept;

}  // namespace plchost
