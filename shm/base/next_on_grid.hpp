#pragma once

#include "shm/base/time.hpp"

namespace plchost {

/// The time after `planned` on the grid of `interval`, or, if that is over, the next one on the same grid.
[[nodiscard]] inline TimePoint next_on_grid(TimePoint planned, TimePoint now, Duration interval) noexcept {
  const TimePoint next = planned + interval;
  return next > now ? next : planned + ((now - planned) / interval + 1) * interval;
}

}  // namespace plchost
