#pragma once

#include "shm/base/time.hpp"

namespace plchost {

// The most that a stop may take. Settings allow no more. A process that asks for a stop waits 3 s longer.

inline constexpr Duration kMaxStopOfOutputs = std::chrono::seconds(10);  ///< tasks that drive outputs
inline constexpr Duration kMaxStopOfOthers = std::chrono::seconds(25);   ///< the other tasks, after them
/// For all that a stop does beside waiting for cycles.
inline constexpr Duration kStopMargin = std::chrono::seconds(3);
inline constexpr Duration kStopLimit = kMaxStopOfOutputs + kMaxStopOfOthers + kStopMargin;

}  // namespace plchost
