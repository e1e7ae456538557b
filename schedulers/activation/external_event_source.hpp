#pragma once

#include <atomic>

#include "schedulers/task/task.hpp"

namespace plchost {

/// An external-event task sleeps on the event's own word: no thread of ours is between the poster and the
/// task, under any scheduler. n posts give n runs; of a backlog beyond its bound the oldest posts are dropped
/// and counted. A count that jumps back, or ahead by 16 times the bound, was written over: that is one run,
/// and counted as lost.
class ExternalEventSource final : public ActivationSource {
 public:
  /// `max_backlog` >= 1.
  ExternalEventSource(Clock& clock, Task& task, std::uint64_t max_backlog) noexcept
      : clock_(clock), task_(task), max_backlog_(max_backlog) {}

  [[nodiscard]] std::optional<Activation> wait() noexcept override;
  void interrupt() noexcept override;

 private:
  Clock& clock_;
  Task& task_;
  std::uint64_t max_backlog_;
  std::atomic<bool> interrupted_{false};
};

}  // namespace plchost
