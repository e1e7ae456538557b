#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace plchost {

/// A time in which a task has begun and not ended. `who`: a number of the caller's.
struct TimeSpan {
  std::int64_t from = 0;
  std::int64_t to = 0;  ///< not before `from`
  std::size_t who = 0;
};

/// A begin or an end on a track on which spans have to nest.
struct NestedStep {
  std::int64_t time = 0;
  std::size_t span = 0;  ///< index of it
  bool begins = false;
  bool again = false;  ///< it had to end for one below it, and goes on
};

/// The spans of tasks of one core as steps of a track. A task that pre-empts another one is within it. When a
/// task ends while one above it waits for something, that one ends with it and begins again. In the order of
/// time, and each end is that of the last begin that has none.
[[nodiscard]] std::vector<NestedStep> nested(std::span<const TimeSpan> spans);

}  // namespace plchost
