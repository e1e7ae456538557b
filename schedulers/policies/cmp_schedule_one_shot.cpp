#include <algorithm>

#include "schedulers/activation/self_timed_sources.hpp"
#include "schedulers/policies/policy.hpp"

namespace plchost {

/// Each task on one-shot absolute deadlines, which its thread sets anew for each cycle and spins up to. The
/// only one under which releases may be moved.
class CmpScheduleOneShot final : public Scheduler {
 public:
  explicit CmpScheduleOneShot(const SchedulerContext& context)
      : clock_(context.clock), rule_(context.settings), spin_ahead_max_(context.settings.spin_ahead_max) {}

  [[nodiscard]] std::string_view name() const noexcept override { return "CmpScheduleOneShot"; }
  [[nodiscard]] SchedulerCapabilities capabilities() const noexcept override { return {.one_shot = true}; }
  [[nodiscard]] Result<std::unique_ptr<ActivationSource>> source_for(Task& task) override {
    // Half of the period at least stays to others. A freewheeling task has none, and sleeps without a guard:
    // nobody plans with its start to the microsecond.
    const Duration guard = std::min(spin_ahead_max_, task.interval() / 2);
    return std::make_unique<DeadlineSource>(clock_, task, rule_, guard);
  }

 private:
  Clock& clock_;
  FreewheelRule rule_;
  Duration spin_ahead_max_;
};

template SchedulerEntry make_policy_entry<CmpScheduleOneShot>(std::string_view);

}  // namespace plchost
