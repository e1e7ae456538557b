// Preloaded into a plc-instance: serves one path as a clock device with a timer behind it, because a test
// cannot make a device of the kernel. CLOCK_DEVICE_PATH: the path. CLOCK_DEVICE_KIND: rtc or hpet.
// CLOCK_DEVICE_PERCENT: its speed, 100 is right. CLOCK_DEVICE_STOP: while this file exists it does not tick.
// CLOCK_DEVICE_BUSY: set if another process has it.
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include <dlfcn.h>
#include <fcntl.h>
#include <linux/hpet.h>
#include <linux/rtc.h>
#include <sys/timerfd.h>
#include <unistd.h>

namespace {

std::atomic<int> device{-1};
std::atomic<unsigned long> hertz{0};

bool is_rtc() {
  const char* const kind = std::getenv("CLOCK_DEVICE_KIND");
  return kind != nullptr && std::strcmp(kind, "rtc") == 0;
}

bool is_stopped() {
  const char* const file = std::getenv("CLOCK_DEVICE_STOP");
  return file != nullptr && ::access(file, F_OK) == 0;
}

int refuse(int error) {
  errno = error;
  return -1;
}

void arm(bool on) {
  constexpr long kSecond = 1'000'000'000;
  const char* const percent = std::getenv("CLOCK_DEVICE_PERCENT");
  const long speed = percent == nullptr ? 100 : std::strtol(percent, nullptr, 10);
  itimerspec timer{};
  if (on) {
    const long period = kSecond * 100 / (static_cast<long>(hertz.load()) * speed);
    timer.it_interval = {.tv_sec = period / kSecond, .tv_nsec = period % kSecond};
    timer.it_value = timer.it_interval;
  }
  ::timerfd_settime(device, 0, &timer, nullptr);
}

// Like a real one, it can be opened only once.
int open_device() {
  if (device >= 0 || std::getenv("CLOCK_DEVICE_BUSY") != nullptr) return refuse(EBUSY);
  device = ::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK);
  return device;
}

bool is_device(const char* path) {
  const char* const served = std::getenv("CLOCK_DEVICE_PATH");
  return served != nullptr && std::strcmp(path, served) == 0;
}

int control(unsigned long request, unsigned long argument) {
  constexpr unsigned long kHighest = 8192;
  if (request == (is_rtc() ? RTC_IRQP_READ : HPET_INFO)) return 0;
  if (request == (is_rtc() ? RTC_IRQP_SET : HPET_IRQFREQ)) {
    const bool power_of_two = argument >= 2 && argument <= kHighest && (argument & (argument - 1)) == 0;
    if (argument == 0 || (is_rtc() && !power_of_two)) return refuse(EINVAL);
    hertz = argument;
    return 0;
  }
  if (request == (is_rtc() ? RTC_PIE_ON : HPET_IE_ON)) return arm(true), 0;
  if (request == (is_rtc() ? RTC_PIE_OFF : HPET_IE_OFF)) return arm(false), 0;
  return refuse(ENOTTY);
}

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

__attribute__((visibility("default"))) int open(const char* path, int flags, ...) {
  if (is_device(path)) return open_device();
  std::va_list arguments;
  va_start(arguments, flags);
  const auto mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  return next<int(const char*, int, ...)>("open")(path, flags, mode);
}

__attribute__((visibility("default"))) int ioctl(int fd, unsigned long request, ...) noexcept {
  std::va_list arguments;
  va_start(arguments, request);
  const auto argument = va_arg(arguments, unsigned long);
  va_end(arguments);
  if (fd >= 0 && fd == device) return control(request, argument);
  return next<int(int, unsigned long, ...)>("ioctl")(fd, request, argument);
}

__attribute__((visibility("default"))) ssize_t read(int fd, void* buffer, size_t size) {
  static auto* const real = next<ssize_t(int, void*, size_t)>("read");
  if (fd < 0 || fd != device) return real(fd, buffer, size);
  std::uint64_t count = 0;
  if (real(fd, &count, sizeof count) != ssize_t{sizeof count}) return -1;
  if (is_stopped()) {
    arm(false);
    return refuse(EAGAIN);
  }
  const unsigned long word = is_rtc() ? (count << 8) | RTC_PF | RTC_IRQF : count;
  std::memcpy(buffer, &word, sizeof word);
  return sizeof word;
}

__attribute__((visibility("default"))) int close(int fd) {
  if (fd >= 0 && fd == device) device = -1;
  return next<int(int)>("close")(fd);
}
}
