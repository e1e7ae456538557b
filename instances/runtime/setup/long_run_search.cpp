#include "instances/runtime/setup/long_run_search.hpp"

#include <array>
#include <span>
#include <utility>

namespace plchost {

std::optional<ProcessorGuard::Taker> LongRunSearch::look(TimePoint now) {
  constexpr int kPart =
      10;  // it has run without a pause if it did nothing else in less than one part of so many
  const Duration gone = now - std::exchange(looked_, now);
  std::array<pid_t, kMost> found{};
  const std::size_t count = times_.real_time_threads(found);
  std::map<pid_t, Run> before = std::exchange(runs_, {});
  std::optional<ProcessorGuard::Taker> taker;
  for (const pid_t thread : std::span(found).first(count)) {
    const Duration used = times_.of_thread(thread);
    const auto known = before.find(thread);
    Run run{.used = used, .lasted = Duration::zero()};
    if (known != before.end() && used - known->second.used >= gone - gone / kPart) {
      run.lasted = known->second.lasted + gone;
    }
    if (run.lasted > limit_ && !taker && concerns_(thread)) {
      if (const ThreadText who = times_.demote(thread); !who.view().empty()) {
        taker = {.who = who, .lasted = run.lasted};
      }
    }
    runs_.emplace(thread, run);
  }
  return taker;
}

}  // namespace plchost
