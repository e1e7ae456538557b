#pragma once

#include <memory>
#include <optional>

#include "schedulers/clock/clock.hpp"
#include "schedulers/tick/tick_choice.hpp"

namespace plchost {

/// Where a periodic tick comes from. One thread waits.
class TickSource {
 public:
  virtual ~TickSource() = default;
  /// Ticks at `first` and then every `period`. The thread that waits.
  virtual void start(TimePoint first, Duration period) noexcept = 0;
  /// Sleeps until the next tick; its planned time. Of several that have passed, the last. Nothing:
  /// interrupted.
  [[nodiscard]] virtual std::optional<TimePoint> wait() noexcept = 0;
  /// Makes wait() return nothing, the one that sleeps now or the next one. Any thread.
  virtual void interrupt() noexcept = 0;
};

/// The source that was chosen. Set-up.
[[nodiscard]] Result<std::unique_ptr<TickSource>> make_tick_source(Clock& clock, const TickChoice& choice);

}  // namespace plchost
