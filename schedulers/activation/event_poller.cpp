#include "schedulers/activation/event_poller.hpp"

#include <algorithm>

#include "schedulers/faults/throw_probe.hpp"

namespace plchost {

void EventPoller::add(Task& task) {
  polled_.push_back({.read = task.config().event_variable, .latch = task.latch(), .fault = &task.fault()});
}

// A thread that reads for all tasks cannot be stopped for one: a fault in a variable is the whole
// application's.
template <class Use>
void EventPoller::read_all(TimePoint now, Use use) noexcept {
  if (polled_.empty()) return;
  const CycleGate::Stay within(&gate_, trap_.seat(), clock_);
  const TimePoint from = clock_.now();
  trap_.arm(*polled_.front().fault, now, true);
  for (const Polled& polled : polled_) {
    if (polled.fault->raised()) continue;
    trap_.change(*polled.fault);
    try {
      use(polled);
    } catch (const ThrowProbe&) {  // never: it only looks at the stack
    } catch (...) {
      raise_current_exception(*polled.fault, true);
    }
  }
  trap_.disarm();
  const TimePoint to = clock_.now();
  if (to - from >= kToldReading) flight_.put(to, FlightKind::polled, (to - from).count());
}

void EventPoller::prime(TimePoint now) noexcept {
  if (std::ranges::all_of(polled_, [](const Polled& polled) { return polled.latch->primed(); })) return;
  read_all(now, [](const Polled& polled) {
    if (!polled.latch->primed()) polled.latch->prime(polled.read());
  });
}

void EventPoller::poll(TimePoint now) noexcept {
  read_all(now, [&](const Polled& polled) {
    if (polled.latch->is_raised()) {
      polled.latch->poll_raised(clock_, now, max_backlog_);
    } else {
      polled.latch->poll(clock_, polled.read(), now);
    }
  });
}

}  // namespace plchost
