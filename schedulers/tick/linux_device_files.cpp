#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "schedulers/tick/device_file.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

class LinuxDeviceFile final : public DeviceFile {
 public:
  LinuxDeviceFile(UniqueFd device, UniqueFd interrupt) noexcept
      : device_(std::move(device)), interrupt_(std::move(interrupt)) {}

  int control(unsigned long request, unsigned long argument) noexcept override {
    return ::ioctl(device_.get(), request, argument) < 0 ? errno : 0;
  }

  Wait wait(TimePoint deadline) noexcept override {
    std::array<pollfd, 2> fds{{{.fd = interrupt_.get(), .events = POLLIN, .revents = 0},
                               {.fd = device_.get(), .events = POLLIN, .revents = 0}}};
    const timespec left = to_timespec(std::max(deadline - MonotonicClock::now(), Duration::zero()));
    if (::ppoll(fds.data(), fds.size(), &left, nullptr) <= 0) return Wait::timed_out;
    if (fds[0].revents == 0) return Wait::readable;
    std::uint64_t count = 0;
    (void)!::read(interrupt_.get(), &count, sizeof count);
    return Wait::interrupted;
  }

  std::optional<unsigned long> read() noexcept override {
    unsigned long word = 0;
    const ssize_t got = ::read(device_.get(), &word, sizeof word);
    if (got == ssize_t{sizeof word}) return word;
    // A short one, or the end of a file, says nothing of errno: the device is broken.
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return 0;
    return std::nullopt;
  }

  void interrupt() noexcept override {
    const std::uint64_t one = 1;
    (void)!::write(interrupt_.get(), &one, sizeof one);
  }

 private:
  UniqueFd device_;
  UniqueFd interrupt_;
};

class LinuxDeviceFiles final : public DeviceFiles {
 public:
  Result<std::unique_ptr<DeviceFile>> open(const std::string& path) override {
    UniqueFd device(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
    if (!device) return failure(ErrorCode::unavailable, fmt::format("cannot open {}", path), errno);
    UniqueFd interrupt(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
    if (!interrupt) return failure(ErrorCode::system, "cannot create an event descriptor", errno);
    return std::make_unique<LinuxDeviceFile>(std::move(device), std::move(interrupt));
  }
};

}  // namespace

DeviceFiles& linux_device_files() noexcept {
  static LinuxDeviceFiles files;
  return files;
}

}  // namespace plchost
