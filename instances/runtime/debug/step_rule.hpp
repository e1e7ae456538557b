#pragma once

#include <cstdint>

#include "instances/plc_debug.h"

namespace plchost {

/// Where a task that goes on halts next, breakpoints apart. Written while the task halts.
struct StepRule {
  enum class Kind : std::uint8_t {
    none,
    into,   ///< at the next statement
    over,   ///< at the next statement of this call, or of a caller
    out,    ///< at the next statement of a caller
    until,  ///< at that line of that POU
  };
  Kind kind = Kind::none;
  std::uint64_t cycle = 0;  ///< in which it began
  std::uint32_t depth = 0;  ///< of calls, where it began
  std::uint32_t line = 0;   ///< the statement where it began; until: the line
  std::uint32_t pou = 0;    ///< the same

  /// Whether to halt at this statement. A cycle that has ended is the return of all calls. Several statements
  /// of one line are one step. Real-time.
  [[nodiscard]] bool halts_at(const Plc_Frame& frame, std::uint64_t in_cycle) const noexcept {
    const bool same_line = frame.pPou->dwNumber == pou && frame.dwLine == line;
    switch (kind) {
      case Kind::none:
        return false;
      case Kind::until:
        return same_line;
      case Kind::into:
        return in_cycle != cycle || frame.dwDepth != depth || !same_line;
      case Kind::over:
        return in_cycle != cycle || frame.dwDepth < depth || (frame.dwDepth == depth && !same_line);
      case Kind::out:
        return in_cycle != cycle || frame.dwDepth < depth;
    }
    return false;
  }
};

}  // namespace plchost
