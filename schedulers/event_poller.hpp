#pragma once

#include <memory>
#include <vector>

#include "schedulers/task.hpp"

namespace plchost {

/// The event tasks of one scheduler: looks at their variables whenever it is told to.
class EventPoller {
 public:
  explicit EventPoller(Clock& clock) noexcept : clock_(clock) {}

  /// The source of an event task, which is polled from now on. Set-up.
  [[nodiscard]] std::unique_ptr<ActivationSource> add(Task& task);
  [[nodiscard]] bool empty() const noexcept { return tasks_.empty(); }
  /// Sees the rising edges since the last poll and activates their tasks. One thread, real-time.
  void poll(TimePoint now) noexcept;

 private:
  Clock& clock_;
  std::vector<Task*> tasks_;
};

}  // namespace plchost
