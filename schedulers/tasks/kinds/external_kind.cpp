#include "schedulers/tasks/external_event_source.hpp"
#include "schedulers/tasks/kinds/kind.hpp"
#include "shm/base/names.hpp"

namespace plchost {

/// Runs for each post of an event that has a name.
class ExternalKind final : public TaskKindState {
 public:
  static constexpr TaskKindEntry kEntry{};

  explicit ExternalKind(const TaskKindContext& context) noexcept
      : clock_(context.clock), cursor_{.event = *context.event, .seen_at = {}} {}

  [[nodiscard]] static Result<void> check(const TaskConfig& task) {
    if (auto name = check_name("external event", task.external_event, kMaxEventName); !name)
      return bad_task(task, name.error().message);
    return {};
  }

  void begin(TimePoint origin, bool takes_posts) noexcept override {
    const std::uint64_t count = takes_posts ? cursor_.event.set_taken(true).count() : cursor_.event.count();
    cursor_.next = cursor_.seen = count;
    cursor_.seen_at = origin;
  }

  [[nodiscard]] std::unique_ptr<ActivationSource> own_source(std::uint64_t max_backlog) override {
    return std::make_unique<ExternalEventSource>(clock_, cursor_, max_backlog);
  }
  [[nodiscard]] bool is_due(TimePoint /*now*/) const noexcept override {
    return cursor_.event.count() != slept_at();
  }

  [[nodiscard]] CountedEvent* event() const noexcept override { return &cursor_.event; }
  [[nodiscard]] std::uint64_t posts_done() const noexcept override { return cursor_.next; }
  [[nodiscard]] std::uint64_t slept_at() const noexcept override {
    return cursor_.slept_at.load(std::memory_order_relaxed);
  }

 private:
  Clock& clock_;
  EventCursor cursor_;
};

template <>
struct KindClass<TaskKind::external> {
  using Type = ExternalKind;
};
template TaskKindEntry make_kind_entry<TaskKind::external>();

}  // namespace plchost
