#include "schedulers/tasks/event_latch.hpp"
#include "schedulers/tasks/kinds/kind.hpp"

namespace plchost {

/// Sleeps until an edge of its variable was seen, under any scheduler.
class EdgeSource final : public ActivationSource {
 public:
  EdgeSource(Clock& clock, EventLatch& latch) noexcept : clock_(clock), latch_(latch) {}

  [[nodiscard]] std::optional<Activation> wait() noexcept override {
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

/// Runs for each rising edge of a BOOL.
class EventKind final : public TaskKindState {
 public:
  static constexpr TaskKindEntry kEntry{};

  explicit EventKind(const TaskKindContext& context) noexcept : clock_(context.clock) {}

  [[nodiscard]] static Result<void> check(const TaskConfig& task) {
    if (!task.event_variable) return bad_task(task, "an event task needs a BOOL variable");
    return {};
  }

  void forget_edges() noexcept override { latch_.forget(); }
  [[nodiscard]] std::unique_ptr<ActivationSource> own_source(std::uint64_t /*max_backlog*/) override {
    return std::make_unique<EdgeSource>(clock_, latch_);
  }
  [[nodiscard]] bool is_due(TimePoint /*now*/) const noexcept override { return latch_.is_due(); }
  [[nodiscard]] EventLatch* latch() noexcept override { return &latch_; }

 private:
  Clock& clock_;
  EventLatch latch_;
};

template <>
struct KindClass<TaskKind::event> {
  using Type = EventKind;
};
template TaskKindEntry make_kind_entry<TaskKind::event>();

}  // namespace plchost
