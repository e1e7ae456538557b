#include "manager/system/disk_thread.hpp"

#include <condition_variable>
#include <csignal>
#include <cstdint>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>

#include <fmt/format.h>
#include <pthread.h>

namespace plchost {

struct DiskThread::Shared {
  std::mutex mutex;
  std::condition_variable changed;
  std::function<void()> next;      // to be begun; null: nothing
  std::optional<TimePoint> begun;  // since when the thread is busy with the one before
  std::uint64_t done = 0;
  bool ending = false;

  void work() {
    std::unique_lock lock(mutex);
    for (;;) {
      changed.wait(lock, [this] { return ending || next; });
      if (ending) return;
      const auto job = std::exchange(next, nullptr);
      begun = MonotonicClock::now();
      lock.unlock();
      job();
      lock.lock();
      begun.reset();
      ++done;
      changed.notify_all();
    }
  }
};

DiskThread::~DiskThread() {
  if (!shared_) return;
  const std::scoped_lock lock(shared_->mutex);
  shared_->ending = true;
  shared_->changed.notify_all();
}

// Signals are for the thread that reads them.
Result<void> DiskThread::start() {
  auto shared = std::make_shared<Shared>();
  sigset_t all{};
  sigset_t before{};
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &before);
  std::error_code error;
  try {
    std::thread([shared] { shared->work(); }).detach();
  } catch (const std::system_error& thrown) {
    error = thrown.code();
  }
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  if (error) return failure(ErrorCode::system, "cannot start a thread", error.value());
  shared_ = std::move(shared);
  return {};
}

Result<void> DiskThread::within(Duration limit, const std::string& what, std::function<void()> work) {
  if (!shared_) {
    if (auto started = start(); !started) return started;
  }
  std::unique_lock lock(shared_->mutex);
  const TimePoint now = MonotonicClock::now();
  const Duration left = shared_->begun.value_or(now) + limit - now;
  const std::uint64_t awaited = shared_->done + (shared_->begun ? 2 : 1);
  shared_->next = std::move(work);
  shared_->changed.notify_all();
  if (shared_->changed.wait_for(lock, left, [&] { return shared_->done >= awaited; })) return {};
  shared_->next = nullptr;
  return failure(ErrorCode::timed_out,
                 fmt::format("{}: the disk has not answered within {} ms", what,
                             std::chrono::duration_cast<std::chrono::milliseconds>(limit).count()));
}

}  // namespace plchost
