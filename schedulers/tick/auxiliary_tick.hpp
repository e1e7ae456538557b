#pragma once

#include <memory>

#include "schedulers/tick/tick_device.hpp"
#include "schedulers/tick/tick_source.hpp"

namespace plchost {

/// The ticks of a clock device. Their planned times are the device's own, see DeviceTime. A device that goes
/// silent, breaks or loses its frequency is left for `backup` in the middle of a wait; why, says
/// TickDevice::fault().
class AuxiliaryTick final : public TickSource {
 public:
  AuxiliaryTick(Clock& clock, std::shared_ptr<TickDevice> device, std::unique_ptr<TickSource> backup) noexcept
      : clock_(clock), device_(std::move(device)), backup_(std::move(backup)) {}

  /// The device has its own phase: `first` is only where the backup would begin.
  void start(TimePoint first, Duration period) noexcept override;
  [[nodiscard]] std::optional<TimePoint> wait() noexcept override;
  void interrupt() noexcept override {
    device_->interrupt();
    backup_->interrupt();
  }

 private:
  void fall_back(TickFault fault) noexcept;
  [[nodiscard]] bool keeps_frequency(TimePoint now) noexcept;

  Clock& clock_;
  std::shared_ptr<TickDevice> device_;
  std::unique_ptr<TickSource> backup_;
  Duration period_{1};
  TimePoint next_;      // where the backup would go on
  TimePoint deadline_;  // by when the device must tick
  bool fallen_ = false;
};

}  // namespace plchost
