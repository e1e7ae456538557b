#pragma once

#include <memory>
#include <string>

#include "instances/runtime/settings/reference_name.hpp"
#include "instances/runtime/time/clock_system.hpp"
#include "schedulers/distributed_clock/clock_model.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// A clock of the host: CLOCK_REALTIME, CLOCK_TAI or a PTP device, read against CLOCK_MONOTONIC. A reading of
/// the clock lies between two of CLOCK_MONOTONIC; of several the one between the nearest two counts. One soft
/// thread.
class HostClock {
 public:
  struct Look {
    ReferencePair pair;
    Duration width{};  ///< between the two readings; the pair is off by half of it at most
  };

  /// `name` is no record. unavailable, wrong_type, unsupported: the text says why. `system` outlives it.
  [[nodiscard]] static Result<std::unique_ptr<HostClock>> open(ClockSystem& system,
                                                               const ReferenceName& name);
  virtual ~HostClock() = default;
  /// busy: look again, another clock was set meanwhile. Other errors say why it cannot be read.
  [[nodiscard]] virtual Result<Look> look() = 0;
  /// "CLOCK_TAI", "/dev/ptp0 (PTP_SYS_OFFSET_EXTENDED)"
  [[nodiscard]] virtual std::string describe() const = 0;

  /// How often the clock is read for one pair.
  static constexpr int kReadings = 5;
};

/// Whether a look is worth a pair: its width is not far above the usual one. A look is wide where the thread
/// has lost the processor in each of its readings. Pure.
class WidthWatch {
 public:
  [[nodiscard]] bool takes(Duration width) noexcept {
    if (usual_ == Duration::zero()) usual_ = width;
    const bool narrow = width <= 2 * usual_ + kSlack;
    // A clock that takes longer from now on is followed after some looks.
    usual_ += narrow ? (width - usual_) / kShare : usual_ / kShare + kSlack / kShare;
    return narrow;
  }

 private:
  static constexpr int kShare = 8;
  static constexpr Duration kSlack = std::chrono::microseconds(1);
  Duration usual_{};
};

}  // namespace plchost
