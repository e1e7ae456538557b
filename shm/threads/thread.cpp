#include "shm/threads/thread.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "shm/base/cpu_list.hpp"
#include "shm/base/futex.hpp"
#include "shm/base/system_call.hpp"
#include "shm/base/time.hpp"

namespace plchost {

namespace {

#if defined(PLCHOST_THREAD_SANITIZER)
constexpr std::size_t kStackSize = std::size_t{4} << 20;  // the sanitizer takes 1 MiB of it for itself
#else
constexpr std::size_t kStackSize = std::size_t{1} << 20;
#endif
// Below each stack: wide enough that no array on it reaches past it into the memory of another thread.
constexpr std::size_t kGuardSize = std::size_t{16} << 20;
constexpr std::size_t kPrefaulted = std::size_t{256} << 10;

struct StartInfo {
  std::string name;
  int fifo = 0;
  int nice = 0;
  std::function<void()> body;
};

// With locked memory the pages are there already; without it, this is what keeps faults out of the first
// cycles.
void prefault_stack() noexcept {
  volatile std::uint8_t
      pages[kPrefaulted];  // NOLINT(modernize-avoid-c-arrays): a stack area is what is wanted
  constexpr std::size_t kPage = 4096;
  for (std::size_t i = 0; i < kPrefaulted; i += kPage) {
    pages[i] = 0;
    (void)pages[i];
  }
}

void* thread_main(void* argument) noexcept {
  const std::unique_ptr<StartInfo> info(static_cast<StartInfo*>(argument));
  pthread_setname_np(pthread_self(), info->name.substr(0, 15).c_str());
  // Its own threads shall not inherit its priority: a thread that the application makes in a cycle runs as
  // SCHED_OTHER unless it is asked for otherwise (PTHREAD_EXPLICIT_SCHED). Cannot fail: nothing is raised.
  if (info->fifo > 0) {
    const sched_param same{.sched_priority = info->fifo};
    ::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &same);
  }
  // A nice value belongs to a thread on Linux; a refusal (negative without the right) leaves the default.
  if (info->nice != 0) ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), info->nice);
  prefault_stack();
  info->body();
  return nullptr;
}

class Attributes {
 public:
  Attributes() noexcept { pthread_attr_init(&value_); }
  ~Attributes() { pthread_attr_destroy(&value_); }
  Attributes(const Attributes&) = delete;
  Attributes& operator=(const Attributes&) = delete;
  [[nodiscard]] pthread_attr_t* get() noexcept { return &value_; }

 private:
  pthread_attr_t value_{};
};

Result<void> set_scheduling(Attributes& attributes, const std::string& name, ThreadPriority priority) {
  const sched_param parameter{.sched_priority = priority.fifo};
  const std::string step = fmt::format("scheduling attributes of thread '{}'", name);
  auto set = check_returned(pthread_attr_setinheritsched(attributes.get(), PTHREAD_EXPLICIT_SCHED), step);
  if (!set) return set;
  const int policy = priority.fifo > 0 ? SCHED_FIFO : SCHED_OTHER;
  set = check_returned(pthread_attr_setschedpolicy(attributes.get(), policy), step);
  if (!set) return set;
  return check_returned(pthread_attr_setschedparam(attributes.get(), &parameter), step);
}

std::vector<int> to_cores(const cpu_set_t& set) {
  std::vector<int> cores;
  for (int core = 0; core < CPU_SETSIZE; ++core) {
    if (CPU_ISSET(static_cast<std::size_t>(core), &set)) cores.push_back(core);
  }
  return cores;
}

}  // namespace

Thread::Thread(Thread&& other) noexcept
    : handle_(other.handle_), running_(std::exchange(other.running_, false)) {}

Thread& Thread::operator=(Thread&& other) noexcept {
  if (this != &other) {
    join();
    handle_ = other.handle_;
    running_ = std::exchange(other.running_, false);
  }
  return *this;
}

void Thread::join() noexcept {
  if (std::exchange(running_, false)) pthread_join(handle_, nullptr);
}

namespace {

// ETIMEDOUT: the thread still runs at that time of CLOCK_MONOTONIC.
int join_by(pthread_t thread, TimePoint time) noexcept {
#if defined(PLCHOST_THREAD_SANITIZER)
  // It does not know pthread_clockjoin_np, and so would take a thread that was joined for one that runs.
  int result = pthread_tryjoin_np(thread, nullptr);
  while (result == EBUSY && MonotonicClock::now() < time) {
    ::usleep(200);
    result = pthread_tryjoin_np(thread, nullptr);
  }
  return result == EBUSY ? ETIMEDOUT : result;
#else
  const timespec until = to_timespec(time);
  return pthread_clockjoin_np(thread, nullptr, CLOCK_MONOTONIC, &until);
#endif
}

}  // namespace

bool Thread::join_until(TimePoint deadline, const std::function<bool()>& abandoned) noexcept {
  constexpr Duration kLook = std::chrono::milliseconds(10);
  while (running_) {
    const Duration left = std::clamp(deadline - MonotonicClock::now(), Duration::zero(), kLook);
    if (join_by(handle_, MonotonicClock::now() + left) != ETIMEDOUT) {
      running_ = false;
    } else if (abandoned()) {
      pthread_detach(handle_);
      running_ = false;
    } else if (left == Duration::zero()) {
      return false;
    }
  }
  return true;
}

Result<Thread> Thread::start(const std::string& name, ThreadPriority priority, std::function<void()> body) {
  Attributes attributes;
  PLCHOST_TRY(set_scheduling(attributes, name, priority));
  pthread_attr_setstacksize(attributes.get(), kStackSize);
  pthread_attr_setguardsize(attributes.get(), kGuardSize);
  auto info = std::make_unique<StartInfo>(StartInfo{name, priority.fifo, priority.nice, std::move(body)});
  Thread thread;
  const int error = pthread_create(&thread.handle_, attributes.get(), &thread_main, info.get());
  if (error == EPERM) {
    return failure(ErrorCode::refused,
                   fmt::format("thread '{}' needs SCHED_FIFO priority {}: give the process CAP_SYS_NICE or "
                               "LimitRTPRIO, and a control group with real-time run time",
                               name, priority.fifo),
                   error);
  }
  PLCHOST_TRY(check_returned(error, fmt::format("cannot start thread '{}'", name)));
  (void)info.release();  // thread_main owns it now
  thread.running_ = true;
  return thread;
}

Result<std::vector<int>> allowed_cores(pid_t thread) {
  cpu_set_t set;
  CPU_ZERO(&set);
  PLCHOST_TRY(
      check_errno(::sched_getaffinity(thread, sizeof set, &set), "cannot read the cores of a thread"));
  return to_cores(set);
}

Result<std::vector<int>> bind_process_to_cores(pid_t pid, const std::vector<int>& cores) {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (const int core : cores) {
    if (core < 0 || core >= CPU_SETSIZE) {
      return failure(ErrorCode::invalid_argument, fmt::format("core {} does not exist", core));
    }
    CPU_SET(static_cast<std::size_t>(core), &set);
  }
  const pid_t process = pid == 0 ? ::getpid() : pid;
  std::error_code error;
  // Advanced by hand: the range-based form throws when the process ends in between.
  std::filesystem::directory_iterator entry(fmt::format("/proc/{}/task", process), error);
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    const auto thread = static_cast<pid_t>(std::strtol(entry->path().filename().c_str(), nullptr, 10));
    auto bound = check_errno(::sched_setaffinity(thread, sizeof set, &set),
                             fmt::format("cannot bind thread {} to core {}", thread, fmt::join(cores, ",")));
    if (!bound && bound.error().system_errno != ESRCH) return std::unexpected(bound.error());
  }
  if (error) return failure(ErrorCode::system, fmt::format("threads of process {}", process), error.value());
  return allowed_cores(process);
}

Result<std::vector<int>> online_cores() {
  const std::string path = "/sys/devices/system/cpu/online";
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) return failure(ErrorCode::system, "cannot read " + path, errno);
  auto cores = parse_cpu_list(line);
  if (!cores) return failure(ErrorCode::corrupt, fmt::format("{} holds '{}'", path, line));
  return *std::move(cores);
}

}  // namespace plchost
