#pragma once

#include "schedulers/activation/event_poller.hpp"
#include "schedulers/tick/tick_table.hpp"
#include "schedulers/tick/ticker.hpp"

namespace plchost {

/// One periodic tick: all that is due is released at the same tick, so that the operating system runs it one
/// after the other by priority. A release between two ticks waits for the next tick; its grid stays as it is.
class CmpSchedule final : public Scheduler {
 public:
  static constexpr std::string_view kName = "CmpSchedule";

  explicit CmpSchedule(const SchedulerContext& context);

  [[nodiscard]] std::string_view name() const noexcept override { return kName; }
  [[nodiscard]] SchedulerCapabilities capabilities() const noexcept override {
    return {.one_shot = false, .external_event_breakpoints = true};
  }
  [[nodiscard]] Result<std::unique_ptr<ActivationSource>> source_for(Task& task) override;
  [[nodiscard]] Result<void> prepare() override;
  [[nodiscard]] bool prime() noexcept override;
  void start(TimePoint origin) noexcept override;
  [[nodiscard]] bool stop(TimePoint deadline) noexcept override { return ticker_.stop(deadline); }

 private:
  [[nodiscard]] bool needs_tick() const noexcept { return !table_.empty() || !poller_.empty(); }
  void on_tick(TimePoint tick) noexcept;

  Clock& clock_;
  SchedulerSettings settings_;
  TickTable table_;
  EventPoller poller_;
  Ticker ticker_;  // last: its thread uses the others
};

[[nodiscard]] std::unique_ptr<Scheduler> make_cmp_schedule(const SchedulerContext& context);

}  // namespace plchost
