#pragma once

#include <memory>
#include <optional>
#include <string>

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// An open clock device: the system calls that it needs. One thread waits and reads.
class DeviceFile {
 public:
  enum class Wait : std::uint8_t { readable, timed_out, interrupted };

  virtual ~DeviceFile() = default;
  /// ioctl(). 0, or errno.
  [[nodiscard]] virtual int control(unsigned long request, unsigned long argument) noexcept = 0;
  /// Sleeps until read() has something to say, at most until `deadline`. Real-time.
  [[nodiscard]] virtual Wait wait(TimePoint deadline) noexcept = 0;
  /// The word that the device gives, 0 if there is none yet; nothing: it is broken. Real-time.
  [[nodiscard]] virtual std::optional<unsigned long> read() noexcept = 0;
  /// Makes wait() return `interrupted`, the one that sleeps now or the next one. Any thread.
  virtual void interrupt() noexcept = 0;
};

/// The seam between clock devices and the operating system: tests make devices of their own.
class DeviceFiles {
 public:
  virtual ~DeviceFiles() = default;
  [[nodiscard]] virtual Result<std::unique_ptr<DeviceFile>> open(const std::string& path) = 0;
};

/// Those of the system.
[[nodiscard]] DeviceFiles& linux_device_files() noexcept;

}  // namespace plchost
