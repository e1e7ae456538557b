#include "schedulers/tasks/task_thread.hpp"

#include <algorithm>
#include <utility>

#include "schedulers/clock/clock.hpp"
#include "schedulers/faults/fault_trap.hpp"
#include "shm/base/futex.hpp"
#include "shm/guard/memory_guard.hpp"

namespace plchost {

namespace {

constexpr Duration kParkedLook = std::chrono::milliseconds(10);

}  // namespace

Result<std::unique_ptr<TaskThread>> TaskThread::start(Clock& clock, Task& task, ThreadPriority priority) {
  std::unique_ptr<TaskThread> self(new TaskThread(clock, task));
  PLCHOST_TRY_ASSIGN(self->thread_, start_clock_thread(clock, task.config().name, priority,
                                                       [raw = self.get()] { raw->run(); }));
  return self;
}

TaskThread::~TaskThread() {
  ending_.store(true);
  park();
  (void)thread_.join_until(kNoDeadline, [this] { return task_.trap().parked(); });
}

void TaskThread::use(ActivationSource* source) noexcept {
  ActivationSource* const before = wanted_.exchange(source);
  order_.fetch_add(1);
  clock_.wake(order_);
  if (before == nullptr) return;
  before->interrupt();
  // The word that it sleeps on may have been in memory that is lost: no wake reaches it there.
  if (MemoryGuard::any_lost()) rouse(thread_);
}

bool TaskThread::settled(TimePoint deadline) noexcept {
  for (;;) {
    const std::uint32_t done = done_.load(std::memory_order_acquire);
    if (done == order_.load() || task_.trap().parked()) return true;
    const TimePoint now = MonotonicClock::now();
    if (now >= deadline) return false;
    futex_wait(&done_, done, std::min(deadline, now + kParkedLook));  // a thread that is parked wakes nobody
  }
}

bool TaskThread::rests() const noexcept {
  if (task_.trap().parked()) return true;
  // A thread that has obeyed leaves its rest only for the next order, and says so before it has obeyed that.
  return done_.load(std::memory_order_acquire) == order_.load() && resting_.load(std::memory_order_acquire);
}

void TaskThread::run() noexcept {
  std::uint32_t obeyed = 0;
  ActivationSource* source = nullptr;
  while (!ending_.load(std::memory_order_acquire)) {
    if (const std::uint32_t order = order_.load(std::memory_order_acquire); order != obeyed) {
      source = wanted_.load(std::memory_order_acquire);
      obeyed = order;
      task_.source_changed();
      resting_.store(source == nullptr, std::memory_order_relaxed);
      done_.store(order, std::memory_order_release);
      futex_wake(&done_);
    } else if (source == nullptr || task_.fault().halts()) {
      resting_.store(true, std::memory_order_release);
      clock_.wait(order_, obeyed, kNoDeadline);
    } else if (const auto activation = source->wait(); activation && !task_.fault().halts()) {
      task_.run_cycle(*activation);
    }
  }
}

}  // namespace plchost
