#include "schedulers/cmp_schedule.hpp"

#include "schedulers/activation/external_event_source.hpp"
#include "schedulers/tick/tick_device.hpp"

namespace plchost {

CmpSchedule::CmpSchedule(const SchedulerContext& context)
    : clock_(context.clock),
      settings_(context.settings),
      table_(context.clock, context.tick_device ? context.tick_device->frequency() : 0),
      poller_(context.clock, context.settings.max_event_backlog, context.poll_trap, context.gate),
      ticker_(context, "tick", poller_, [this](TimePoint tick) { on_tick(tick); }) {}

Result<std::unique_ptr<ActivationSource>> CmpSchedule::source_for(Task& task) {
  switch (task.config().kind) {
    case TaskKind::event:
      return poller_.add(task);
    case TaskKind::external:
      return std::make_unique<ExternalEventSource>(clock_, task, settings_.max_event_backlog);
    case TaskKind::cyclic:
    case TaskKind::freewheeling:
      break;
  }
  return table_.add(task, FreewheelRule(settings_));
}

Result<void> CmpSchedule::prepare() {
  if (!needs_tick()) return {};
  return ticker_.prepare();
}

bool CmpSchedule::prime() noexcept {
  return !needs_tick() || ticker_.prime();
}

void CmpSchedule::start(TimePoint origin) noexcept {
  if (!needs_tick()) return;
  // A task that was due before the first tick, while a switch was under way, is only late and runs at once.
  const TimePoint first = ticker_.first_tick(origin);
  table_.start(first - settings_.scheduler_interval);
  ticker_.start(first);
}

void CmpSchedule::on_tick(TimePoint tick) noexcept {
  table_.on_tick(tick);
  poller_.poll(tick);
}

std::unique_ptr<Scheduler> make_cmp_schedule(const SchedulerContext& context) {
  return std::make_unique<CmpSchedule>(context);
}

}  // namespace plchost
