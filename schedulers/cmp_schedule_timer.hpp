#pragma once

#include "schedulers/self_timed_scheduler.hpp"

namespace plchost {

/// Each cyclic task on a periodic timer of the kernel of its own, which its thread reads itself.
class CmpScheduleTimer final : public SelfTimedScheduler {
 public:
  static constexpr std::string_view kName = "CmpScheduleTimer";

  using SelfTimedScheduler::SelfTimedScheduler;

  [[nodiscard]] std::string_view name() const noexcept override { return kName; }
  [[nodiscard]] SchedulerCapabilities capabilities() const noexcept override { return {}; }

 private:
  [[nodiscard]] Result<std::unique_ptr<ActivationSource>> cyclic_source(const Task& task) override;
};

[[nodiscard]] std::unique_ptr<Scheduler> make_cmp_schedule_timer(const SchedulerContext& context);

}  // namespace plchost
