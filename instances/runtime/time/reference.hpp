#pragma once

#include <memory>
#include <string>

#include "schedulers/distributed_clock/distributed_clock.hpp"
#include "shm/pages/instance_page.hpp"

namespace plchost {

/// The clock that [DistributedClock] Reference names, as the schedulers see it. It outlives the tasks that
/// follow it. Control thread.
class Reference {
 public:
  virtual ~Reference() = default;
  Reference(const Reference&) = delete;
  Reference& operator=(const Reference&) = delete;

  /// Takes up a clock that has come, or lets go of one that is gone; every beat, as long as the tasks are
  /// there.
  virtual void refresh() = 0;
  /// Why there is none to follow; empty: there is.
  [[nodiscard]] const std::string& problem() const noexcept { return problem_; }

 protected:
  explicit Reference(DistributedClock& clock) noexcept : clock_(clock) {}
  [[nodiscard]] DistributedClock& clock() const noexcept { return clock_; }
  /// Logs a problem that is another one than before. Empty: there is none any more.
  void tell(std::string problem);

 private:
  DistributedClock& clock_;
  std::string problem_;
};

/// Makes `clock` follow what its settings name. Where there is none that can be used it runs freely until
/// there is. Null: they name nothing.
[[nodiscard]] std::unique_ptr<Reference> follow_reference(DistributedClock& clock,
                                                          const DistributedClockSettings& settings,
                                                          const std::string& pool);

/// How the status page describes the clock: all but the name of the reference, and why it cannot be read.
[[nodiscard]] ClockRuntime clock_runtime(const DistributedClock& clock) noexcept;

}  // namespace plchost
