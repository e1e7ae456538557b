#include "schedulers/activation/event_poller.hpp"

namespace plchost {

namespace {

class EdgeSource final : public ActivationSource {
 public:
  EdgeSource(Clock& clock, EventLatch& latch) noexcept : clock_(clock), latch_(latch) {}

  std::optional<Activation> wait() noexcept override {
    for (;;) {
      if (const auto seen_at = latch_.take()) {
        return Activation{.release = *seen_at, .lost_events = latch_.take_lost()};
      }
      if (latch_.gate.wait(clock_) != ActivationGate::Outcome::opened) return std::nullopt;
    }
  }
  void interrupt() noexcept override { latch_.gate.interrupt(clock_); }

 private:
  Clock& clock_;
  EventLatch& latch_;
};

}  // namespace

std::unique_ptr<ActivationSource> EventPoller::add(Task& task) {
  polled_.push_back({.read = task.config().event_variable, .latch = &task.latch(), .fault = &task.fault()});
  return std::make_unique<EdgeSource>(clock_, task.latch());
}

// A thread that reads for all tasks cannot be stopped for one: a fault in a variable is the whole
// application's.
template <class Use>
void EventPoller::read_all(TimePoint now, Use use) noexcept {
  if (polled_.empty()) return;
  std::optional<CycleGate::Stay> within;
  if (gate_ != nullptr) within.emplace(gate_, gate_->variables(), clock_);
  trap_.arm(*polled_.front().fault, now, true);
  for (const Polled& polled : polled_) {
    if (polled.fault->raised()) continue;
    trap_.change(*polled.fault);
    try {
      use(polled);
    } catch (...) {
      raise_current_exception(*polled.fault, true);
    }
  }
  trap_.disarm();
}

void EventPoller::prime(TimePoint now) noexcept {
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
