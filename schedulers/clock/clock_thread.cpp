#include "schedulers/clock/clock_thread.hpp"

#include <memory>
#include <utility>

#include <sys/prctl.h>

namespace plchost {

Result<Thread> start_clock_thread(Clock& clock, const std::string& name, ThreadPriority priority,
                                  std::function<void()> body) {
  PLCHOST_TRY_ASSIGN(auto signals, AlternateStack::make());
  auto stack = std::make_shared<AlternateStack>(std::move(signals));
  clock.thread_begins();
  auto thread = Thread::start(name, priority, [&clock, stack = std::move(stack), body = std::move(body)] {
    const AlternateStack::Use use(*stack);
    // SCHED_FIFO has none; the others would wake up to 50 us late.
    ::prctl(PR_SET_TIMERSLACK, 1UL);
    body();
    clock.thread_ends();
  });
  if (!thread) clock.thread_ends();
  return thread;
}

}  // namespace plchost
