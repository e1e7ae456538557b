#pragma once

#include <memory>
#include <optional>

#include "schedulers/scheduler.hpp"
#include "schedulers/tick/tick_capabilities.hpp"

namespace plchost {

/// Where a periodic tick comes from. One thread waits.
class TickSource {
 public:
  virtual ~TickSource() = default;
  [[nodiscard]] virtual TickCapabilities capabilities() const noexcept = 0;
  /// Ticks at `first` and then every `period`. The thread that waits.
  virtual void start(TimePoint first, Duration period) noexcept = 0;
  /// Sleeps until the next tick; its planned time. Of several that have passed, the last. Nothing:
  /// interrupted.
  [[nodiscard]] virtual std::optional<TimePoint> wait() noexcept = 0;
  /// Makes wait() return nothing, the one that sleeps now or the next one. Any thread.
  virtual void interrupt() noexcept = 0;
};

/// The capabilities of a timer of the kernel, and of a thread in absolute sleeps.
inline constexpr TickCapabilities kKernelTimerCapabilities{.periods = TickCapabilities::Periods::linear,
                                                           .resolution = Duration(1),
                                                           .shortest = std::chrono::microseconds(50),
                                                           .longest = kMaxInterval,
                                                           .one_shot = true};

/// The source of context.settings.tick_source. Set-up.
[[nodiscard]] Result<std::unique_ptr<TickSource>> make_tick_source(const SchedulerContext& context);

}  // namespace plchost
