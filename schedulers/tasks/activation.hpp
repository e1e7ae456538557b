#pragma once

#include <cstdint>
#include <optional>

#include "shm/base/time.hpp"

namespace plchost {

/// Why and for when a task runs one cycle. The meaning of `release` depends on the kind of the task. Cyclic:
/// the point of the grid. Freewheeling: the end of its sleep. Event: the poll that saw the edge. External:
/// the moment at which the task first saw the post in the event's counter. All posts seen at once share it,
/// so those that queue behind others show their wait as latency.
struct Activation {
  TimePoint release;              ///< planned; latency is measured from here
  std::uint64_t lost_cycles = 0;  ///< releases that passed since the last activation without a cycle
  std::uint64_t lost_events =
      0;  ///< external events dropped since then, beyond the backlog's bound, or edges beyond what is kept
  Duration spun{};                      ///< time burnt ahead of the release
  std::uint64_t timer_expirations = 0;  ///< how often the task's own kernel timer went off since the last one
  bool single_cycle = false;            ///< no other release is planned
};

/// The source that one task waits on; made for that task by the scheduler, or by the task's kind. The only
/// place where a task thread sleeps.
class ActivationSource {
 public:
  virtual ~ActivationSource() = default;
  /// Task thread, real-time. Nothing: interrupted; the thread looks at what it shall do next.
  [[nodiscard]] virtual std::optional<Activation> wait() noexcept = 0;
  /// Makes wait() return nothing, the one that sleeps now or the next one that would sleep. Any thread.
  virtual void interrupt() noexcept = 0;
};

}  // namespace plchost
