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

void EventPoller::poll(TimePoint now) noexcept {
  for (Task* task : tasks_) task->latch().poll(clock_, task->config().event_variable(), now);
}

}  // namespace plchost
