#include "schedulers/self_timed_scheduler.hpp"

#include "schedulers/activation/deadline_source.hpp"
#include "schedulers/activation/external_event_source.hpp"

namespace plchost {

SelfTimedScheduler::SelfTimedScheduler(const SchedulerContext& context)
    : clock_(context.clock),
      settings_(context.settings),
      poller_(context.clock, context.settings.max_event_backlog, context.poll_trap, context.gate),
      ticker_(context, "event-poll", poller_, [this](TimePoint tick) { poller_.poll(tick); }) {}

Result<std::unique_ptr<ActivationSource>> SelfTimedScheduler::source_for(Task& task) {
  switch (task.config().kind) {
    case TaskKind::event:
      return poller_.add(task);
    case TaskKind::external:
      return std::make_unique<ExternalEventSource>(clock_, task, settings_.max_event_backlog);
    case TaskKind::freewheeling:
      // Nobody plans with the start of its cycle to the microsecond: it sleeps without a guard.
      return std::make_unique<DeadlineSource>(clock_, task, FreewheelRule(settings_), Duration::zero());
    case TaskKind::cyclic:
      break;
  }
  return cyclic_source(task);
}

Result<void> SelfTimedScheduler::prepare() {
  if (poller_.empty()) return {};
  return ticker_.prepare();
}

bool SelfTimedScheduler::prime() noexcept {
  return poller_.empty() || ticker_.prime();
}

void SelfTimedScheduler::start(TimePoint origin) noexcept {
  if (poller_.empty()) return;
  // Between the releases of the cyclic tasks: at the same instant the poll, which goes first, would delay
  // them.
  ticker_.start(ticker_.first_tick(origin) + settings_.scheduler_interval / 2);
}

}  // namespace plchost
