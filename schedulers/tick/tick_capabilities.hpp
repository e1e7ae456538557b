#pragma once

#include <cstdint>

#include "shm/base/time.hpp"

namespace plchost {

/// The capabilities of a source of ticks.
struct TickCapabilities {
  /// linear: any period in steps of the resolution. whole_hertz: 1 s / n. powers_of_two: 1 s / 2^n.
  enum class Periods : std::uint8_t { linear, whole_hertz, powers_of_two };
  Periods periods = Periods::linear;
  Duration resolution{1};
  Duration shortest{};
  Duration longest{};
  bool one_shot = true;  ///< can be set to an absolute time each cycle
};

}  // namespace plchost
