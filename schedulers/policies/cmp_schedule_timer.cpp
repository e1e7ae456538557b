#include <utility>

#include "schedulers/activation/self_timed_sources.hpp"
#include "schedulers/policies/policy.hpp"

namespace plchost {

/// Each cyclic task on a periodic timer of the kernel of its own, which its thread reads itself.
class CmpScheduleTimer final : public Scheduler {
 public:
  explicit CmpScheduleTimer(const SchedulerContext& context)
      : clock_(context.clock), rule_(context.settings) {}

  [[nodiscard]] std::string_view name() const noexcept override { return "CmpScheduleTimer"; }
  [[nodiscard]] SchedulerCapabilities capabilities() const noexcept override { return {}; }
  [[nodiscard]] Result<std::unique_ptr<ActivationSource>> source_for(Task& task) override {
    // A freewheeling task has no period that a timer could have.
    if (task.interval() == Duration::zero())
      return std::make_unique<DeadlineSource>(clock_, task, rule_, Duration::zero());
    PLCHOST_TRY_ASSIGN(auto timer, clock_.make_periodic_timer());
    return std::make_unique<TimerSource>(clock_, task, rule_, std::move(timer));
  }

 private:
  Clock& clock_;
  FreewheelRule rule_;
};

template SchedulerEntry make_policy_entry<CmpScheduleTimer>(std::string_view);

}  // namespace plchost
