#pragma once

#include "schedulers/activation/event_poller.hpp"
#include "schedulers/tick/ticker.hpp"

namespace plchost {

/// The common part of the schedulers under which each cyclic and freewheeling task keeps its own time. A
/// thread of the scheduler's own is there only to poll event variables, and only if there are any.
class SelfTimedScheduler : public Scheduler {
 public:
  explicit SelfTimedScheduler(const SchedulerContext& context);

  [[nodiscard]] Result<std::unique_ptr<ActivationSource>> source_for(Task& task) final;
  [[nodiscard]] Result<void> prepare() final;
  [[nodiscard]] bool prime() noexcept final;
  void start(TimePoint origin) noexcept final;
  [[nodiscard]] bool stop(TimePoint deadline) noexcept final { return ticker_.stop(deadline); }

 protected:
  [[nodiscard]] virtual Result<std::unique_ptr<ActivationSource>> cyclic_source(const Task& task) = 0;
  [[nodiscard]] Clock& clock() const noexcept { return clock_; }
  [[nodiscard]] const SchedulerSettings& settings() const noexcept { return settings_; }

 private:
  Clock& clock_;
  SchedulerSettings settings_;
  EventPoller poller_;
  Ticker ticker_;  // last: its thread uses the poller
};

}  // namespace plchost
