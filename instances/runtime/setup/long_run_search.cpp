#include "instances/runtime/setup/long_run_search.hpp"

#include <array>
#include <span>
#include <utility>

namespace plchost {

std::optional<ProcessorGuard::Taker> LongRunSearch::look(TimePoint now) {
  // A run ends with a pause of one part of so many of it. The kernel's are shorter: 50 ms of a second.
  constexpr int kPart = 10;
  std::array<pid_t, kMost> found{};
  const std::size_t count = times_.real_time_threads(found);
  std::map<pid_t, Run> before = std::exchange(runs_, {});
  std::optional<ProcessorGuard::Taker> taker;
  for (const pid_t thread : std::span(found).first(count)) {
    const Duration used = times_.of_thread(thread);
    const Run anew{.began = now, .used_before = used};
    const auto known = before.find(thread);
    Run run = known != before.end() ? known->second : anew;
    const Duration lasted = now - run.began;
    if (used - run.used_before < lasted - lasted / kPart) run = anew;
    if (now - run.began > limit_ && !taker && concerns_(thread)) {
      if (const ThreadText who = times_.demote(thread); !who.view().empty()) {
        taker = {.who = who, .lasted = now - run.began};
      }
    }
    runs_.emplace(thread, run);
  }
  return taker;
}

}  // namespace plchost
