#include "api/cli/repeat.hpp"

#include <algorithm>
#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

#include "api/cli/interrupt.hpp"

namespace plchost {

int repeat(double every_s, const Action& action) {
  catch_interrupts();
  const bool terminal = ::isatty(STDOUT_FILENO) != 0;
  const auto every = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(every_s));
  int code = 0;
  for (TimePoint next = MonotonicClock::now(); !interrupted();) {
    if (terminal) fmt::print("\x1b[H\x1b[2J");
    code = action();
    std::fflush(stdout);
    if (code != 0 && !terminal) break;
    next = std::max(next + every, MonotonicClock::now());
    sleep_until_interrupted(next);
    if (!terminal && !interrupted()) fmt::print("\n");
  }
  return code;
}

}  // namespace plchost
