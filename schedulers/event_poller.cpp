#include "schedulers/event_poller.hpp"

namespace plchost {

namespace {

class EdgeSource final : public ActivationSource {
 public:
  EdgeSource(Clock& clock, EventLatch& latch) noexcept : clock_(clock), latch_(latch) {}

  std::optional<Activation> wait() noexcept override {
    if (latch_.gate.wait(clock_) != ActivationGate::Outcome::opened) return std::nullopt;
    return Activation{.release = latch_.seen_at(), .lost_events = latch_.take_lost()};
  }
  void interrupt() noexcept override { latch_.gate.interrupt(clock_); }

 private:
  Clock& clock_;
  EventLatch& latch_;
};

}  // namespace

std::unique_ptr<ActivationSource> EventPoller::add(Task& task) {
  tasks_.push_back(&task);
  return std::make_unique<EdgeSource>(clock_, task.latch());
}

// Whoever reads for all tasks cannot be stopped for one: a fault in a variable is the whole application's.
template <class Use>
void EventPoller::read_all(TimePoint now, Use use) noexcept {
  if (tasks_.empty()) return;
  trap_.arm(tasks_.front()->fault(), now, true);
  for (Task* task : tasks_) {
    if (task->fault().raised()) continue;
    trap_.change(task->fault());
    try {
      use(*task);
    } catch (...) {
      raise_current_exception(task->fault(), true);
    }
  }
  trap_.disarm();
}

void EventPoller::prime(TimePoint now) noexcept {
  read_all(now, [](Task& task) {
    if (!task.latch().primed()) task.latch().prime(task.config().event_variable());
  });
}

void EventPoller::poll(TimePoint now) noexcept {
  read_all(now, [&](Task& task) { task.latch().poll(clock_, task.config().event_variable(), now); });
}

}  // namespace plchost
