#include "schedulers/clock_thread.hpp"

#include <utility>

#include <sys/prctl.h>

namespace plchost {

Result<Thread> start_clock_thread(Clock& clock, const std::string& name, ThreadPriority priority,
                                  std::function<void()> body) {
  clock.thread_begins();
  auto thread = Thread::start(name, priority, [&clock, body = std::move(body)] {
    // SCHED_FIFO has none; the others would wake up to 50 us late.
    ::prctl(PR_SET_TIMERSLACK, 1UL);
    body();
    clock.thread_ends();
  });
  if (!thread) clock.thread_ends();
  return thread;
}

}  // namespace plchost
