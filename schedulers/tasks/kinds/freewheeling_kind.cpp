#include "schedulers/tasks/kinds/kind.hpp"

namespace plchost {

/// Runs again and again, and leaves a share of the processor to others.
class FreewheelingKind final : public TaskKindState {
 public:
  static constexpr TaskKindEntry kEntry{.timed = true, .limits_itself = true};

  explicit FreewheelingKind(const TaskKindContext& context) noexcept : clock_(context.clock) {}

  [[nodiscard]] static Result<void> check(const TaskConfig& /*task*/) { return {}; }

  void begin(TimePoint /*origin*/, bool /*takes_posts*/) noexcept override { begun_ = false; }
  // Only here it is worth the system calls: it sleeps by what it has used itself.
  void cycle_begins(TimePoint /*release*/) noexcept override { used_before_ = clock_.thread_time(); }
  Duration cycle_ended(TimePoint /*release*/, TimePoint /*end*/) noexcept override {
    last_execution_ = clock_.thread_time() - used_before_;
    begun_ = true;
    return {};
  }

  [[nodiscard]] Activation next_release(TimePoint ready, const FreewheelRule& rule) const noexcept override {
    return {.release = begun_ ? ready + rule.sleep_after(last_execution_) : ready};
  }

 private:
  Clock& clock_;
  Duration used_before_{};     // processor time of the thread when its cycle began
  Duration last_execution_{};  // processor time of its last cycle
  bool begun_ = false;         // has run since begin()
};

template <>
struct KindClass<TaskKind::freewheeling> {
  using Type = FreewheelingKind;
};
template TaskKindEntry make_kind_entry<TaskKind::freewheeling>();

}  // namespace plchost
