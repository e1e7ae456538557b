#include "tests/models/checker/pi_futex.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdarg>
#include <cstdlib>

#include <linux/futex.h>
#include <sys/syscall.h>
#include <time.h>

#include "shm/threads/process_start.hpp"
#include "tests/models/checker/explorer.hpp"

namespace plchost::models {

namespace {

PiFutex* kernel = nullptr;  // of the scene
std::array<char, kMaxThreads> places;

constexpr std::uint32_t number_of(std::uint64_t word) noexcept {
  return static_cast<std::uint32_t>(word) & FUTEX_TID_MASK;
}

}  // namespace

PiFutex::PiFutex(Scene& scene) {
  kernel = this;
  scene.when_killed([this](ThreadNumber thread) { thread_was_killed(thread); });
}

std::uintptr_t PiFutex::sleeping_place(ThreadNumber thread) noexcept {
  return reinterpret_cast<std::uintptr_t>(&places[thread]);
}

auto PiFutex::leave(ThreadNumber thread) -> Waiter {
  Waiter* const end = queue_.data() + waiting_;
  Waiter* const found = std::find_if(queue_.data(), end, [&](const Waiter& w) { return w.thread == thread; });
  if (found == end) return {};
  const Waiter left = *found;
  std::move(found + 1, end, found);
  queue_[--waiting_] = {};
  return left;
}

void PiFutex::grant(bool owner_died) {
  queue_[0].granted = true;
  queue_[0].owner_died = owner_died;
  explorer()->wake(sleeping_place(queue_[0].thread), 1);
}

void PiFutex::thread_was_killed(ThreadNumber thread) {
  const bool was_granted = leave(thread).granted;
  if (!was_granted && owner_ != static_cast<int>(thread)) return;
  owner_ = kGone;
  if (waiting_ > 0) grant(true);
}

// An errno. A waiter makes a state of the kernel's, which names the owner; the word must fit it.
int PiFutex::lock(std::uintptr_t word) {
  Explorer& scene = *explorer();
  const ThreadNumber self = scene.self();
  int error = 0;
  bool waits = false;
  const std::uint64_t old = scene.memory().exchange(self, word, 4, Order::relaxed, [&](std::uint64_t before) {
    const std::uint32_t holder = number_of(before);
    if (holder == id_of(self)) {
      error = EDEADLK;
    } else if (waiting_ > 0) {
      waits = owner_ != kGone && holder == id_of(static_cast<ThreadNumber>(owner_));
      error = waits ? 0 : EINVAL;
    } else if (holder == 0) {
      return (before & FUTEX_OWNER_DIED) | id_of(self);
    } else {
      waits = !scene.killed(holder - id_of(0));
      error = waits ? 0 : ESRCH;
      return before | FUTEX_WAITERS;
    }
    return before;
  });
  scene.done("kernel locks", word, static_cast<std::uint64_t>(error), old);
  if (!waits) return error;
  owner_ = static_cast<int>(number_of(old) - id_of(0));
  queue_[waiting_++] = {.thread = self};
  (void)scene.sleep(sleeping_place(self), true);
  const Waiter left = leave(self);
  scene.done("kernel returns", word, left.owner_died ? 1 : 0, left.granted ? 1 : 0);
  if (!left.granted) return ETIMEDOUT;
  if (left.owner_died) {
    scene.memory().exchange(self, word, 4, Order::relaxed, [&](std::uint64_t) {
      return std::uint64_t{id_of(self)} | FUTEX_WAITERS | FUTEX_OWNER_DIED;
    });
    if (scene.last_killed() >= 0) scene.memory().learn(self, static_cast<unsigned>(scene.last_killed()));
  }
  owner_ = static_cast<int>(self);
  return 0;
}

int PiFutex::unlock(std::uintptr_t word) {
  Explorer& scene = *explorer();
  const ThreadNumber self = scene.self();
  int error = 0;
  scene.memory().exchange(self, word, 4, Order::relaxed, [&](std::uint64_t before) {
    if (number_of(before) != id_of(self)) {
      error = EPERM;
    } else if (waiting_ == 0) {
      return std::uint64_t{0};
    } else if (owner_ != static_cast<int>(self)) {
      error = EINVAL;
    } else {
      return std::uint64_t{id_of(queue_[0].thread)} | FUTEX_WAITERS;
    }
    return before;
  });
  if (error == 0 && waiting_ > 0) {
    owner_ = static_cast<int>(queue_[0].thread);
    grant(false);
  }
  scene.done("kernel unlocks", word, static_cast<std::uint64_t>(error), waiting_);
  return error;
}

}  // namespace plchost::models

namespace plchost {

const ThreadIdentity& this_thread() noexcept {
  static std::array<ThreadIdentity, models::kMaxThreads> threads;
  const unsigned self = models::explorer()->self();
  threads[self] = {.id = models::PiFutex::id_of(self), .start = 1000 + self, .image = 7};
  return threads[self];
}

// A thread that sees the end of another one knows all that it has done: the kernel has ended it.
std::optional<ThreadLook> look_at_thread(pid_t thread) noexcept {
  const models::Arena::Use off(false);
  models::Explorer& scene = *models::explorer();
  const auto number = static_cast<unsigned>(thread) - models::PiFutex::id_of(0);
  scene.step(models::Explorer::kAnywhere, true);
  const bool killed = scene.killed(number);
  scene.done("looks at thread", 0, number, killed ? 1 : 0);
  if (!killed) return ThreadLook{.start = 1000 + number, .image = 7, .ending = false};
  scene.memory().learn(scene.self(), number);
  return std::nullopt;
}

}  // namespace plchost

// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming,cert-dcl50-cpp): the linker's names
extern "C" long __wrap_syscall(long number, ...) {
  using namespace plchost::models;
  std::va_list arguments;
  va_start(arguments, number);
  const auto word = reinterpret_cast<std::uintptr_t>(va_arg(arguments, void*));
  const int operation = va_arg(arguments, int);
  va_end(arguments);
  if (number != SYS_futex || kernel == nullptr) std::abort();
  const Arena::Use off(false);
  Explorer& scene = *explorer();
  scene.step(word, true);
  scene.memory().pass_lock(scene.self(), word);
  const int error = operation == FUTEX_UNLOCK_PI ? kernel->unlock(word) : kernel->lock(word);
  scene.memory().pass_lock(scene.self(), word);
  errno = error;
  return error == 0 ? 0 : -1;
}

// A pause ends when nothing else can run: by then all has happened that it waits for.
extern "C" int __wrap_clock_nanosleep(clockid_t /*clock*/, int /*flags*/, const timespec* /*until*/,
                                      timespec* /*rest*/) {
  using namespace plchost::models;
  const Arena::Use off(false);
  Explorer& scene = *explorer();
  scene.step(Explorer::kAnywhere, true);
  (void)scene.sleep(reinterpret_cast<std::uintptr_t>(&kernel), true);
  return 0;
}
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming,cert-dcl50-cpp)
