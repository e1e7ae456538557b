#pragma once

#include "schedulers/self_timed_scheduler.hpp"

namespace plchost {

/// Each cyclic task on absolute one-shot deadlines, computed anew each cycle; its thread wakes ahead of the
/// release by an adaptive guard and spins the rest.
class CmpScheduleOneShot final : public SelfTimedScheduler {
 public:
  static constexpr std::string_view kName = "CmpScheduleOneShot";

  using SelfTimedScheduler::SelfTimedScheduler;

  [[nodiscard]] std::string_view name() const noexcept override { return kName; }
  [[nodiscard]] SchedulerCapabilities capabilities() const noexcept override {
    return {.one_shot = true, .external_event_breakpoints = false};
  }

 private:
  [[nodiscard]] Result<std::unique_ptr<ActivationSource>> cyclic_source(const Task& task) override;
};

[[nodiscard]] std::unique_ptr<Scheduler> make_cmp_schedule_one_shot(const SchedulerContext& context);

}  // namespace plchost
