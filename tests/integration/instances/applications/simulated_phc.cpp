// Preloaded into a plc-instance: serves one path as a PTP device, because a test cannot make one of the
// kernel. All processes that read the same file have the same clock. SIMULATED_PHC_PATH: the path.
// SIMULATED_PHC_FILE: see SimulatedPhc.
// SIMULATED_PHC_GONE: while this file exists there is no device.
#include "tests/integration/instances/simulated_phc.hpp"

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>

#include <dlfcn.h>
#include <fcntl.h>
#include <linux/ptp_clock.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/sysmacros.h>
#include <time.h>
#include <unistd.h>

namespace {

using plchost::testing::SimulatedPhc;

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr unsigned kMajor = 4000;  // of no device of the kernel
constexpr unsigned kMinor = 7;

std::atomic<int> device{-1};

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

int refuse(int error) {
  errno = error;
  return -1;
}

bool is_device(const char* path) {
  const char* const served = std::getenv("SIMULATED_PHC_PATH");
  return served != nullptr && std::strcmp(path, served) == 0;
}

bool is_gone() {
  const char* const file = std::getenv("SIMULATED_PHC_GONE");
  return file != nullptr && ::access(file, F_OK) == 0;
}

SimulatedPhc read_phc() {
  const char* const path = std::getenv("SIMULATED_PHC_FILE");
  return path == nullptr ? SimulatedPhc{} : SimulatedPhc::read(path);
}

// Without dlsym(): that allocates, and the allocator of a sanitizer reads the time.
int real_time(clockid_t clock, timespec* to) {
  return static_cast<int>(::syscall(SYS_clock_gettime, clock, to));
}

std::int64_t nanoseconds(clockid_t clock) {
  timespec now{};
  real_time(clock, &now);
  return now.tv_sec * kSecond + now.tv_nsec;
}

ptp_clock_time to_ptp(std::int64_t ns) {
  ptp_clock_time time{};
  time.sec = ns / kSecond;
  time.nsec = static_cast<std::uint32_t>(ns % kSecond);
  return time;
}

int control(unsigned long request, void* argument) {
  if (is_gone()) return refuse(ENODEV);
  const SimulatedPhc phc = read_phc();
  if (request == PTP_SYS_OFFSET_PRECISE && phc.way == "precise") {
    auto& stamps = *static_cast<ptp_sys_offset_precise*>(argument);
    const std::int64_t before = nanoseconds(CLOCK_MONOTONIC);
    stamps.sys_realtime = to_ptp(nanoseconds(CLOCK_REALTIME));
    const std::int64_t after = nanoseconds(CLOCK_MONOTONIC);
    stamps.device = to_ptp(phc.at(before + (after - before) / 2));
    return 0;
  }
  if (request == PTP_SYS_OFFSET_EXTENDED && phc.way != "none") {
    auto& stamps = *static_cast<ptp_sys_offset_extended*>(argument);
    if (stamps.n_samples == 0 || stamps.n_samples > PTP_MAX_SAMPLES || stamps.rsv[0] != 0)
      return refuse(EINVAL);
    for (unsigned i = 0; i < stamps.n_samples; ++i) {
      stamps.ts[i][0] = to_ptp(nanoseconds(CLOCK_REALTIME));
      stamps.ts[i][1] = to_ptp(phc.at(nanoseconds(CLOCK_MONOTONIC)));
      stamps.ts[i][2] = to_ptp(nanoseconds(CLOCK_REALTIME));
    }
    return 0;
  }
  return refuse(request == PTP_SYS_OFFSET_PRECISE || request == PTP_SYS_OFFSET_EXTENDED ? EOPNOTSUPP
                                                                                        : ENOTTY);
}

void fill(struct stat& status) {
  status = {};
  status.st_mode = S_IFCHR | S_IRUSR | S_IWUSR;
  status.st_rdev = makedev(kMajor, kMinor);
}

}  // namespace

#define EXPORTED __attribute__((visibility("default")))

extern "C" {

EXPORTED int open(const char* path, int flags, ...) {
  std::va_list arguments;
  va_start(arguments, flags);
  const auto mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  auto* const real = next<int(const char*, int, ...)>("open");
  if (!is_device(path)) return real(path, flags, mode);
  if (is_gone()) return refuse(ENOENT);
  device = real("/dev/null", O_RDONLY | O_CLOEXEC);
  return device;
}

EXPORTED int stat(const char* path, struct stat* status) noexcept {
  if (!is_device(path)) return next<int(const char*, struct stat*)>("stat")(path, status);
  if (is_gone()) return refuse(ENOENT);
  fill(*status);
  return 0;
}

EXPORTED int fstat(int fd, struct stat* status) noexcept {
  if (fd < 0 || fd != device) return next<int(int, struct stat*)>("fstat")(fd, status);
  fill(*status);
  return 0;
}

EXPORTED ssize_t readlink(const char* path, char* buffer, size_t size) noexcept {
  static const std::string link =
      "/sys/dev/char/" + std::to_string(kMajor) + ":" + std::to_string(kMinor) + "/subsystem";
  if (path != link) return next<ssize_t(const char*, char*, size_t)>("readlink")(path, buffer, size);
  constexpr const char kTarget[] = "../../../../class/ptp";
  const size_t length = size < sizeof kTarget - 1 ? size : sizeof kTarget - 1;
  std::memcpy(buffer, kTarget, length);
  return static_cast<ssize_t>(length);
}

EXPORTED int ioctl(int fd, unsigned long request, ...) noexcept {
  std::va_list arguments;
  va_start(arguments, request);
  void* const argument = va_arg(arguments, void*);
  va_end(arguments);
  if (fd >= 0 && fd == device) return control(request, argument);
  return next<int(int, unsigned long, ...)>("ioctl")(fd, request, argument);
}

EXPORTED int clock_gettime(clockid_t clock, timespec* to) noexcept {
  const int fd = device;
  if (clock >= 0 || fd < 0 || clock != static_cast<clockid_t>((~static_cast<unsigned>(fd) << 3U) | 3U)) {
    return real_time(clock, to);
  }
  if (is_gone()) return refuse(ENODEV);
  // The file takes its time: the clock is read in the middle of it.
  const std::int64_t before = nanoseconds(CLOCK_MONOTONIC);
  const SimulatedPhc phc = read_phc();
  const ptp_clock_time now = to_ptp(phc.at(before + (nanoseconds(CLOCK_MONOTONIC) - before) / 2));
  *to = {.tv_sec = now.sec, .tv_nsec = now.nsec};
  return 0;
}

EXPORTED int close(int fd) {
  if (fd >= 0 && fd == device) device = -1;
  return next<int(int)>("close")(fd);
}
}
