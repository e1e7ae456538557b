#pragma once

#include <cstdint>

#include "schedulers/distributed_clock/clock_model.hpp"
#include "schedulers/settings/scheduler_settings.hpp"

namespace plchost {

/// Learns the line between the local and the reference clock from pairs of stamps, never from wake-up times.
/// Those are late by tens of microseconds, and an integrator fed with them never settles. Pure, no
/// allocation.
///
/// A PI loop: each pair's deviation from the line moves the phase by Kp and the drift by Ki of it. The first
/// pairs count more: their gains are those of a line through all pairs so far. So phase and drift are there
/// within a few dozen pairs, and the gains then sink to Kp and Ki. They rise again when the deviations keep
/// to one side: then the drift has changed.
///
/// A pair further off than the usual scatter allows is an outlier and left out. But kStepPairs of them in a
/// row that lie on one line of a plausible drift are a step of the reference: the line is moved there. The
/// grids follow the line at their own bounded pace. Outliers that lie on no such line, as those of a
/// reference that stands still, runs backwards or says anything, are never taken, however long they go on.
/// The followers never see them.
class ClockRegulator {
 public:
  /// Pairs until the line may be followed.
  static constexpr std::uint32_t kUsablePairs = 8;
  static constexpr std::uint32_t kStepPairs = 5;
  /// A clock further off is none: half of what the default bound of the correction can follow.
  static constexpr double kMaxDrift = 5e-3;
  /// Reference times beyond it (146 years either way) are taken for rubbish.
  static constexpr std::int64_t kMaxReferenceNs = std::int64_t{1} << 62;
  /// Two stamps closer together tell nothing about the drift.
  static constexpr Duration kMinSpacing = std::chrono::microseconds(20);

  enum class Verdict : std::uint8_t {
    taken,
    skipped,       ///< too close to the pair before
    outlier,       ///< left out for now
    stepped,       ///< the last of kStepPairs outliers on one line: ours was moved there
    out_of_order,  ///< its local stamp is not after the one before
    out_of_range,
  };

  explicit ClockRegulator(const DistributedClockSettings& settings) noexcept;

  /// Real-time.
  Verdict feed(const ReferencePair& pair) noexcept;

  [[nodiscard]] const ClockModel& model() const noexcept { return model_; }
  /// The line is good enough to be followed.
  [[nodiscard]] bool usable() const noexcept { return pairs_ >= kUsablePairs; }
  /// How far the last pairs lay from the line on the average, signed: the rest that the loop has not yet made
  /// up for.
  [[nodiscard]] double bias_ns() const noexcept { return bias_ns_; }

 private:
  void begin(const ReferencePair& pair) noexcept;
  void take(double error_ns, Duration elapsed) noexcept;
  Verdict leave_out(const ReferencePair& pair, double error_ns) noexcept;
  void step_to(const ReferencePair& pair, double drift) noexcept;
  void widen(double error_ns) noexcept;
  [[nodiscard]] double noise_ns() const noexcept;
  [[nodiscard]] double limit_ns(Duration elapsed) const noexcept;

  double kp_;
  double ki_;
  double tolerance_ns_;
  Duration gap_;             // after that much silence the phase is learnt anew
  ClockModel model_;         // anchored at the last pair that was taken
  std::uint32_t pairs_ = 0;  // that the gains are for; not above kEnoughPairs
  double spacing_ns_ = 0;    // usual distance of two pairs
  double bias_ns_ = 0;
  double scatter_ns_;           // usual magnitude of a deviation
  std::uint32_t outliers_ = 0;  // in a row that lie on one line
  TimePoint run_began_;         // the first of them
  double run_error_ns_ = 0;
  double last_outlier_ns_ = 0;
};

}  // namespace plchost
