#include "schedulers/tick/tick_table.hpp"

#include <algorithm>
#include <limits>

#include "schedulers/tasks/activation_gate.hpp"

namespace plchost {

namespace {

// The state of a task while it does not wait, and the one that a tick writes when it takes the task.
constexpr Duration::rep kNotDue = std::numeric_limits<Duration::rep>::max();
constexpr Duration::rep kClaimed = kNotDue - 1;

Duration::rep to_count(TimePoint when) noexcept {
  return when.time_since_epoch().count();
}

}  // namespace

/// One task's line in the table, and what the task waits on.
class TickTable::Slot final : public ActivationSource, public DueQueue::Entry {
 public:
  Slot(TickTable& table, const Task& task, FreewheelRule rule) noexcept
      : table_(table), task_(task), rule_(rule) {}

  // A task that comes back while its tick is being worked off must not be missed. Either the task sees that
  // tick, or the tick sees the task: each writes its own word before it reads the other's, all of it
  // sequentially consistent. If both do, the first to change `due` has it. Either the task leaves, or the
  // tick claims it, and then the task takes its turn in the order, because others are woken by it.
  std::optional<Activation> wait() noexcept override {
    const Activation activation = task_.next_release(rule_);
    const Duration interval = task_.interval();
    const Duration::rep release = to_count(activation.release) - table_.slack(interval);
    if (table_.last_tick_.load() >= release) return table_.on_the_tick(activation, interval);
    due.store(release);
    table_.hand_in(*this);
    const bool passed = table_.last_tick_.load() >= release;
    if (!passed && gate_.wait(table_.clock_) == ActivationGate::Outcome::opened) {
      wake_next();
      return table_.on_the_tick(activation, interval);
    }
    if (due.exchange(kNotDue) == kClaimed) {
      gate_.pass(table_.clock_);
      wake_next();
    }
    if (!passed) return std::nullopt;  // the release is not run yet, so the next wait() has it again
    return table_.on_the_tick(activation, interval);
  }

  void interrupt() noexcept override { gate_.interrupt(table_.clock_); }

  void open() noexcept { gate_.open(table_.clock_); }
  [[nodiscard]] int priority() const noexcept { return task_.config().iec_priority; }

  std::atomic<Duration::rep> due{kNotDue};
  std::atomic<bool> handed_in{false};  // on the list, or about to be
  Slot* next_in = nullptr;             // on that list
  Slot* next_due = nullptr;            // woken by this one; written by the tick that claimed both
  std::size_t rank = 0;                // 0: the highest priority

 private:
  void wake_next() noexcept {
    if (next_due != nullptr) next_due->open();
  }

  TickTable& table_;
  const Task& task_;
  FreewheelRule rule_;
  ActivationGate gate_;
};

std::unique_ptr<ActivationSource> TickTable::add(const Task& task, FreewheelRule rule) {
  auto slot = std::make_unique<Slot>(*this, task, rule);
  slots_.insert(std::ranges::upper_bound(slots_, slot->priority(), {}, &Slot::priority), slot.get());
  for (std::size_t i = 0; i < slots_.size(); ++i) slots_[i]->rank = i;
  queue_.reserve(slots_.capacity());
  due_.reserve(slots_.capacity());
  return slot;
}

bool TickTable::runs_on_ticks(Duration interval) const noexcept {
  constexpr Duration::rep kSecond = 1'000'000'000;
  return frequency_ != 0 && interval > Duration::zero() &&
         interval.count() % kSecond * frequency_ % kSecond == 0;
}

// How much earlier than planned the tick of a release may come: the nearest tick it is, whatever the device
// has drifted since the one before.
Duration::rep TickTable::slack(Duration interval) const noexcept {
  if (!runs_on_ticks(interval)) return 0;
  return 1'000'000'000 / Duration::rep{frequency_} * 2 / 5;
}

// The thread of the task may see a later tick than the one that released it. Then the release stays as
// planned, and the next one is put on its tick.
Activation TickTable::on_the_tick(Activation activation, Duration interval) const noexcept {
  if (!runs_on_ticks(interval)) return activation;
  const Duration::rep tick = device_tick_.load();
  const Duration::rep behind = tick - (to_count(activation.release) - slack(interval));
  if (behind >= 0 && behind < 1'000'000'000 / Duration::rep{frequency_})
    activation.release = TimePoint(Duration(tick));
  return activation;
}

void TickTable::start(TimePoint tick) noexcept {
  last_tick_.store(to_count(tick));
}

// The task's thread. One that is on the list already will be looked at after this, so it sees the new time.
void TickTable::hand_in(Slot& slot) noexcept {
  if (slot.handed_in.exchange(true)) return;
  slot.next_in = handed_in_.load(std::memory_order_relaxed);
  while (!handed_in_.compare_exchange_weak(slot.next_in, &slot)) {
  }
}

auto TickTable::on_tick(TimePoint tick) noexcept -> Work {
  const Duration::rep now = to_count(tick);
  if (frequency_ != 0) device_tick_.store(now);  // before the tick can be seen
  last_tick_.store(now);
  Work work;
  due_.clear();
  take_in(now, work);
  take_due(now, work);
  work.released = due_.size();
  if (due_.empty()) return work;
  std::ranges::sort(due_, {}, &Slot::rank);
  for (std::size_t i = 0; i < due_.size(); ++i) {
    due_[i]->next_due = i + 1 < due_.size() ? due_[i + 1] : nullptr;
  }
  due_.front()->open();
  return work;
}

// The tasks that came back since the tick before. The period of many tasks is one tick: they need no place in
// the queue.
void TickTable::take_in(Duration::rep tick, Work& work) noexcept {
  for (Slot* slot = handed_in_.exchange(nullptr); slot != nullptr; ++work.looked_at) {
    Slot* const next = slot->next_in;
    slot->handed_in.exchange(false);
    const Duration::rep due = slot->due.load();
    if (due > tick && due < kClaimed) {
      queue_.put(*slot, due);
    } else {
      queue_.remove(*slot);  // it left before its time, and came back
      if (due <= tick) claim(*slot, due);
    }
    slot = next;
  }
}

void TickTable::take_due(Duration::rep tick, Work& work) noexcept {
  while (DueQueue::Entry* const entry = queue_.take_due(tick)) {
    auto& slot = static_cast<Slot&>(*entry);
    ++work.looked_at;
    // Later now, or not waiting at all: it hands itself in for its next state.
    if (const Duration::rep due = slot.due.load(); due <= tick) claim(slot, due);
  }
}

// The task may leave at the same moment, because it has seen the tick or was interrupted.
void TickTable::claim(Slot& slot, Duration::rep due) noexcept {
  if (slot.due.compare_exchange_strong(due, kClaimed)) due_.push_back(&slot);
}

}  // namespace plchost
