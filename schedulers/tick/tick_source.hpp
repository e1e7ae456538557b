#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "schedulers/clock/clock.hpp"
#include "schedulers/settings/scheduler_settings.hpp"
#include "schedulers/tick/tick_device.hpp"

namespace plchost {

/// Which source of ticks a scheduler gets.
struct TickChoice {
  TickSourceKind kind = TickSourceKind::system;
  std::shared_ptr<TickDevice> device;  ///< of TickSourceKind::auxiliary
  std::string fallback;                ///< why it is not the one that the settings ask for; empty: it is
};

/// The tick source that the settings name, or the system's clock if that is not there or cannot make the
/// period. `known` is used again if it is the same device: most can be opened only once. Set-up.
[[nodiscard]] TickChoice choose_tick(const SchedulerSettings& settings, DeviceFiles& files,
                                     const std::shared_ptr<TickDevice>& known);

/// Of a scheduler that sets its timer anew each cycle. unsupported: the source cannot. The text says why, and
/// what can.
[[nodiscard]] Result<void> check_one_shot(std::string_view scheduler, const TickChoice& choice);

/// Where the ticks come from now.
struct TickReport {
  std::string source;    ///< "System", "Task", "Auxiliary /dev/rtc0 (RTC, 1024 Hz)"
  std::string fallback;  ///< why it is not the one that the settings ask for; empty: it is
};
[[nodiscard]] TickReport report_of(const TickChoice& choice);

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
