// The least that a program with a cycle in real time can be: locks its memory, starts one SCHED_FIFO thread,
// and stamps its first cycle. Linked like any other program, with nothing but the C++ library.

#include <sched.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include "tests/bench/bench.hpp"
#include "tests/bench/shared_board.hpp"
#include "tests/bench/start_board.hpp"

int main() {
  using namespace plchost;  // NOLINT(google-build-using-namespace): a program's main file
  ::mlockall(MCL_CURRENT | MCL_FUTURE);
  auto& board = bench::open_board<bench::StartBoard>();
  auto thread = Thread::start("cycle", bench::kPriority, [&board] {
    // As ours: it is waited for that long, so that all threads are there when the first release comes.
    const timespec until = to_timespec(MonotonicClock::now() + std::chrono::milliseconds(2));
    ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
    board.record(MonotonicClock::now().time_since_epoch().count());
  });
  ::pause();
  return thread ? 0 : 1;
}
