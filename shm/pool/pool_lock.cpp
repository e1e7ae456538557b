#include "shm/pool/pool_lock.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>

#include <fmt/format.h>
#include <linux/futex.h>
#include <signal.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/base/time.hpp"

namespace plchost {

namespace {

// Set-up under the mutex takes microseconds, a repair of the largest pool some 100 ms.
constexpr auto kPatience = std::chrono::seconds(5);

class MutexAttributes {
 public:
  MutexAttributes() noexcept { pthread_mutexattr_init(&value_); }
  ~MutexAttributes() { pthread_mutexattr_destroy(&value_); }
  MutexAttributes(const MutexAttributes&) = delete;
  MutexAttributes& operator=(const MutexAttributes&) = delete;
  [[nodiscard]] pthread_mutexattr_t* get() noexcept { return &value_; }

 private:
  pthread_mutexattr_t value_{};
};

Result<void> init(pthread_mutex_t& mutex) {
  MutexAttributes attributes;
  auto done = check_returned(pthread_mutexattr_setpshared(attributes.get(), PTHREAD_PROCESS_SHARED),
                             "process-shared mutex");
  if (done) {
    done =
        check_returned(pthread_mutexattr_setrobust(attributes.get(), PTHREAD_MUTEX_ROBUST), "robust mutex");
  }
  if (done) {
    done = check_returned(pthread_mutexattr_setprotocol(attributes.get(), PTHREAD_PRIO_INHERIT),
                          "priority-inheriting mutex");
  }
  if (done) done = check_returned(pthread_mutex_init(&mutex, attributes.get()), "mutex of the pool");
  return done;
}

int kind_of_ours() {
  pthread_mutex_t mutex{};
  if (!init(mutex)) return -1;
  const int kind = mutex.__data.__kind;
  pthread_mutex_destroy(&mutex);
  return kind;
}

std::uint32_t word_of(pthread_mutex_t& mutex) noexcept {
  const auto word =
      static_cast<std::uint32_t>(std::atomic_ref(mutex.__data.__lock).load(std::memory_order_acquire));
  return word;
}

// The C library trusts its mutexes: with a foreign word in one it aborts, or sleeps for ever. So it is looked
// at before: either free, or held by another living thread, or marked by the kernel as left by a dead one.
bool is_sane(pthread_mutex_t& mutex) {
  static const int kind = kind_of_ours();
  if (std::atomic_ref(mutex.__data.__kind).load(std::memory_order_relaxed) != kind) return false;
  const std::uint32_t word = word_of(mutex);
  const auto holder = static_cast<pid_t>(word & FUTEX_TID_MASK);
  if (holder == 0) return true;
  if (holder == ::gettid()) return false;
  // A holder that ended after the look either released it or was marked, so the word is another one now.
  return ::kill(holder, 0) == 0 || errno != ESRCH || word_of(mutex) != word;
}

// pthread_mutex_clocklock() would do in one call, but the thread sanitizer does not see it (and with
// timedlock not that an owner died, so trylock goes first). A wall clock that is set meanwhile only costs
// another round.
int lock_until(pthread_mutex_t& mutex, TimePoint deadline) noexcept {
  if (const int error = pthread_mutex_trylock(&mutex); error != EBUSY) return error;
  for (;;) {
    const Duration left = std::max(deadline - MonotonicClock::now(), Duration::zero());
    const timespec until = to_timespec(Duration(unix_time_ns()) + left);
    const int error = pthread_mutex_timedlock(&mutex, &until);
    if (error != ETIMEDOUT || left == Duration::zero()) return error;
  }
}

}  // namespace

Result<void> PoolLock::make_mutex(PoolHeader& header) {
  return init(header.mutex);
}

Result<PoolLock> PoolLock::acquire(PoolHeader& header, const std::string& pool) {
  if (!is_sane(header.mutex)) {
    return failure(
        ErrorCode::corrupt,
        fmt::format("pool '{}': its mutex is damaged; stop who uses the pool and remove it", pool));
  }
  const int error = lock_until(header.mutex, MonotonicClock::now() + kPatience);
  switch (error) {
    case 0:
      return PoolLock(header, false);
    case EOWNERDEAD:
      return PoolLock(header, true);
    case ETIMEDOUT:
      return failure(ErrorCode::timed_out,
                     fmt::format("pool '{}': thread {} holds its mutex for more than {} s", pool,
                                 word_of(header.mutex) & FUTEX_TID_MASK, kPatience.count()));
    default:
      return failure(ErrorCode::corrupt, fmt::format("lock pool '{}'", pool), error);
  }
}

PoolLock::~PoolLock() {
  if (header_ != nullptr) pthread_mutex_unlock(&header_->mutex);
}

void PoolLock::make_consistent() noexcept {
  pthread_mutex_consistent(&header_->mutex);
  owner_died_ = false;
}

}  // namespace plchost
