#include "schedulers/tick_table.hpp"

#include <algorithm>

namespace plchost {

namespace {

constexpr Duration::rep kNotDue = Duration::max().count();

Duration::rep to_count(TimePoint when) noexcept {
  return when.time_since_epoch().count();
}

}  // namespace

/// One task's line in the table, and what the task waits on.
class TickTable::Slot final : public ActivationSource {
 public:
  Slot(TickTable& table, const Task& task, FreewheelRule rule) noexcept
      : table_(table), task_(task), rule_(rule) {}

  // A task that comes back while its tick is being worked off must not be missed. Either the task sees that
  // tick, or the tick sees the task: each writes its own word before it reads the other's, all of it
  // sequentially consistent.
  std::optional<Activation> wait() noexcept override {
    const Activation activation = task_.next_release(rule_);
    const Duration::rep release = to_count(activation.release);
    due_.store(release);
    while (table_.last_tick_.load() < release) {
      if (gate_.wait(table_.clock_) == ActivationGate::Outcome::interrupted) {
        due_.store(kNotDue);
        return std::nullopt;
      }
    }
    due_.store(kNotDue);
    return activation;
  }

  void interrupt() noexcept override { gate_.interrupt(table_.clock_); }

  [[nodiscard]] int priority() const noexcept { return task_.config().iec_priority; }
  bool release_if_due(Duration::rep tick) noexcept {
    return due_.load() <= tick && gate_.open(table_.clock_);
  }

 private:
  TickTable& table_;
  const Task& task_;
  FreewheelRule rule_;
  std::atomic<Duration::rep> due_{kNotDue};
  ActivationGate gate_;
};

std::unique_ptr<ActivationSource> TickTable::add(const Task& task, FreewheelRule rule) {
  auto slot = std::make_unique<Slot>(*this, task, rule);
  slots_.push_back(slot.get());
  return slot;
}

void TickTable::start(TimePoint tick) noexcept {
  std::ranges::stable_sort(slots_, {}, &Slot::priority);
  last_tick_.store(to_count(tick));
}

std::size_t TickTable::on_tick(TimePoint tick) noexcept {
  const Duration::rep now = to_count(tick);
  last_tick_.store(now);
  std::size_t released = 0;
  for (Slot* slot : slots_) released += slot->release_if_due(now) ? 1U : 0U;
  return released;
}

}  // namespace plchost
