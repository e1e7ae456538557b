#include "schedulers/task_thread.hpp"

#include <utility>

#include "schedulers/clock_thread.hpp"
#include "shm/base/futex.hpp"

namespace plchost {

Result<std::unique_ptr<TaskThread>> TaskThread::start(Clock& clock, Task& task, ThreadPriority priority) {
  std::unique_ptr<TaskThread> self(new TaskThread(clock, task));
  auto thread = start_clock_thread(clock, task.config().name, priority, [raw = self.get()] { raw->run(); });
  if (!thread) return std::unexpected(std::move(thread.error()));
  self->thread_ = std::move(*thread);
  return self;
}

TaskThread::~TaskThread() {
  ending_.store(true);
  park();
}

void TaskThread::use(ActivationSource* source) noexcept {
  ActivationSource* const before = wanted_.exchange(source);
  order_.fetch_add(1);
  clock_.wake(order_);
  if (before != nullptr) before->interrupt();
}

bool TaskThread::settled(TimePoint deadline) noexcept {
  for (;;) {
    const std::uint32_t done = done_.load(std::memory_order_acquire);
    if (done == order_.load()) return true;
    if (MonotonicClock::now() >= deadline) return false;
    futex_wait(&done_, done, deadline);
  }
}

void TaskThread::run() noexcept {
  std::uint32_t obeyed = 0;
  ActivationSource* source = nullptr;
  while (!ending_.load(std::memory_order_acquire)) {
    if (const std::uint32_t order = order_.load(std::memory_order_acquire); order != obeyed) {
      source = wanted_.load(std::memory_order_acquire);
      obeyed = order;
      done_.store(order, std::memory_order_release);
      futex_wake(&done_);
    } else if (source == nullptr) {
      clock_.wait(order_, obeyed, kNoDeadline);
    } else if (const auto activation = source->wait()) {
      task_.run_cycle(*activation);
    }
  }
}

}  // namespace plchost
