#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <vector>

#include "api/client/async.hpp"
#include "api/client/pump.hpp"
#include "shm/base/time.hpp"

namespace plchost {

namespace at_once {

// The next one that has not begun yet, until none is left.
template <class Work>
Async<bool> go_through(Pump& pump, std::size_t count, std::size_t& next, const Work& work) {
  while (next < count) (void)co_await work(next++);
  pump.look_again();
  co_return true;
}

}  // namespace at_once

/// Operations number 0 to `count` - 1, at most 16 of them at the same time. Ends when all have ended.
/// @param work makes the operation of a number; the operation's result does not matter here
template <std::invocable<std::size_t> Work>
Async<bool> all_at_once(Pump& pump, std::size_t count, Work work) {
  constexpr std::size_t kMost = 16;
  std::size_t next = 0;
  std::vector<Async<bool>> ways;
  for (std::size_t i = 0; i < std::min(kMost, count); ++i) {
    ways.push_back(at_once::go_through(pump, count, next, work));
    ways.back().start();
  }
  for (const Async<bool>& way : ways) {
    while (!way.done()) co_await pump.change(TimePoint::max());
  }
  co_return true;
}

}  // namespace plchost
