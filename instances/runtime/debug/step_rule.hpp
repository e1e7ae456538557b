#pragma once

#include <cstdint>

#include "instances/plc_debug.h"

namespace plchost {

/// Where a task that goes on halts next, breakpoints apart. Written while the task halts.
struct StepRule {
  enum class Kind : std::uint8_t {
    none,
    into,   ///< at the next statement
    over,   ///< at the next statement of `call`
    until,  ///< at that line of that POU
  };
  Kind kind = Kind::none;
  std::uint64_t cycle = 0;          ///< in which it began
  const Plc_Frame* call = nullptr;  ///< where it began, or a caller; null: it ends with the cycle
  std::uint32_t line = 0;           ///< the statement where it began, 0: in another call; until: the line
  std::uint32_t pou = 0;            ///< the same
  const void* marker = nullptr;     ///< of the statement where it began

  /// The step of "next" from a statement: see DebugTask::statement().
  [[nodiscard]] static StepRule over(const Plc_Frame& from, const void* marker,
                                     std::uint64_t in_cycle) noexcept {
    return {.kind = Kind::over,
            .cycle = in_cycle,
            .call = &from,
            .line = from.dwLine,
            .pou = from.pPou->dwNumber,
            .marker = marker};
  }
  /// A call returns. Its caller takes its place: another call may lie at the same address. Real-time.
  void leaves(const Plc_Frame& frame) noexcept {
    if (&frame != call || kind == Kind::until) return;
    call = frame.pCaller;
    line = 0;
  }

  /// Whether to halt at this statement. A cycle that has ended is the return of all calls. Several statements
  /// of one line are one step, up to the next run of the first in a loop. Real-time.
  [[nodiscard]] bool halts_at(const Plc_Frame& frame, const void* at, std::uint64_t in_cycle) const noexcept {
    const bool in_line = frame.pPou->dwNumber == pou && frame.dwLine == line;
    const bool same_step = in_line && at != marker;
    switch (kind) {
      case Kind::none:
        return false;
      case Kind::until:
        return in_line;
      case Kind::into:
        return in_cycle != cycle || &frame != call || !same_step;
      case Kind::over:
        return in_cycle != cycle || (&frame == call && !same_step);
    }
    return false;
  }
};

}  // namespace plchost
