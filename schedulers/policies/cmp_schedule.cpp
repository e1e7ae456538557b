#include <utility>

#include "schedulers/policies/policy.hpp"
#include "schedulers/tick/tick_table.hpp"

namespace plchost {

/// One periodic tick: all that is due is released at the same tick, so that the operating system runs it one
/// after the other by priority. A release between two ticks waits for the next tick; its grid stays as it is.
class CmpSchedule final : public Scheduler {
 public:
  static constexpr bool kHaltsExternalTasks = true;

  explicit CmpSchedule(const SchedulerContext& context)
      : rule_(context.settings), table_(context.clock, context.tick_frequency) {}

  [[nodiscard]] std::string_view name() const noexcept override { return "CmpSchedule"; }
  [[nodiscard]] SchedulerCapabilities capabilities() const noexcept override {
    return {.ticks = true, .one_shot = false};
  }
  [[nodiscard]] Result<std::unique_ptr<ActivationSource>> source_for(Task& task) override {
    return table_.add(task, rule_);
  }
  void on_tick(TimePoint tick) noexcept override {
    if (std::exchange(begun_, true)) {
      table_.on_tick(tick);
    } else {
      table_.start(tick);  // a release before it is late, and runs as soon as its task comes
    }
  }

 private:
  FreewheelRule rule_;
  TickTable table_;
  bool begun_ = false;
};

template SchedulerEntry make_policy_entry<CmpSchedule>(std::string_view);

}  // namespace plchost
