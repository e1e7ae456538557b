#include "api/cli/repeat.hpp"

#include <algorithm>
#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

#include "api/cli/interrupt.hpp"
#include "api/cli/output.hpp"

namespace plchost {

int repeat(const Repetition& repetition, const Action& action) {
  catch_interrupts();
  const bool terminal = ::isatty(STDOUT_FILENO) != 0;
  const auto every = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(repetition.every_s));
  TimePoint next = MonotonicClock::now();
  int code = 0;
  for (std::uint64_t i = 0; repetition.count == 0 || i < repetition.count; ++i) {
    if (i > 0) sleep_until_interrupted(next);
    if (interrupted()) break;
    if (!repetition.for_programs && terminal) fmt::print("\x1b[H\x1b[2J");
    if (!repetition.for_programs && !terminal && i > 0) fmt::print("\n");
    code = action();
    flush_output();
    if (code != 0 && !terminal) break;
    next = std::max(next + every, MonotonicClock::now());
  }
  return code;
}

}  // namespace plchost
