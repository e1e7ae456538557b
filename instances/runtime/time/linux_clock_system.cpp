#include <array>
#include <cerrno>
#include <string_view>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/timex.h>
#include <unistd.h>

#include "instances/runtime/time/clock_system.hpp"

namespace plchost {

namespace {

// The kernel's own word: the link to the class of the device ends in ".../class/ptp".
bool is_ptp_clock(const struct stat& status) {
  if (!S_ISCHR(status.st_mode)) return false;
  const std::string link =
      fmt::format("/sys/dev/char/{}:{}/subsystem", major(status.st_rdev), minor(status.st_rdev));
  std::array<char, 256> target{};
  const ssize_t size = ::readlink(link.c_str(), target.data(), target.size());
  return size > 0 && std::string_view(target.data(), static_cast<std::size_t>(size)).ends_with("/ptp");
}

class LinuxClockSystem final : public ClockSystem {
 public:
  int time(clockid_t clock, timespec& to) noexcept override {
    return ::clock_gettime(clock, &to) == 0 ? 0 : errno;
  }

  int tai_offset() noexcept override {
    timex kernel{};
    return ::adjtimex(&kernel) < 0 ? 0 : kernel.tai;
  }

  // Looked at before it is opened: to open a watchdog, say, starts it.
  Result<UniqueFd> open(const std::string& path) override {
    struct stat named{};
    if (::stat(path.c_str(), &named) != 0)
      return failure(ErrorCode::unavailable, "cannot open " + path, errno);
    if (!is_ptp_clock(named)) return refused(path);
    UniqueFd device(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
    if (!device) return failure(ErrorCode::unavailable, "cannot open " + path, errno);
    struct stat opened{};
    const bool same =
        ::fstat(device.get(), &opened) == 0 && S_ISCHR(opened.st_mode) && opened.st_rdev == named.st_rdev;
    if (!same) return refused(path);
    return device;
  }

  int control(int device, unsigned long request, void* argument) noexcept override {
    return ::ioctl(device, request, argument) < 0 ? errno : 0;
  }

 private:
  static std::unexpected<Error> refused(const std::string& path) {
    return failure(ErrorCode::wrong_type,
                   fmt::format("{} is no PTP clock: only devices of /sys/class/ptp are", path));
  }
};

}  // namespace

ClockSystem& linux_clock_system() noexcept {
  static LinuxClockSystem system;
  return system;
}

}  // namespace plchost
