#include "schedulers/distributed_clock/clock_regulator.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace plchost {

namespace {

constexpr double kPpm = 1e-6;
/// Beyond it the gains of a line through all pairs are below any Kp and Ki.
constexpr std::uint32_t kEnoughPairs = 1'000'000;
/// Where the gains begin again after a step or a silence (the drift is still known), and when the drift has
/// changed.
constexpr std::uint32_t kPairsAfterStep = 8;
constexpr std::uint32_t kPairsAfterChange = 16;
/// Averages over about this many pairs.
constexpr double kAveragedPairs = 32;
/// Deviations that keep to one side: their average is nearly as large as their magnitude.
constexpr double kOneSided = 0.8;
/// An outlier is this many times further off than usual.
constexpr double kUsualTimes = 8;
/// Noise that is larger than the tolerance by more is none: so far, and no further, what is usual widens.
constexpr double kWidestNoiseNs = 100'000;
/// A step has to be looked at for this many times the noise. A clock that stands still, or runs at half of
/// its speed, is then further off than the noise can hide.
constexpr double kTimesNoise = 4;
/// One wild pair widens what is usual by no more than a pair at this many times of it would.
constexpr double kScatterClip = 4;
/// The change of the drift that is allowed between two pairs. While it is not known yet, and when two clocks
/// are compared that may be different ones, it is kMaxDrift.
constexpr double kDriftChange = 20e-6;

}  // namespace

ClockRegulator::ClockRegulator(const DistributedClockSettings& settings) noexcept
    : kp_(settings.kp_ppm * kPpm),
      ki_(settings.ki_ppm * kPpm),
      tolerance_ns_(static_cast<double>(settings.pair_tolerance.count())),
      gap_(settings.reference_timeout),
      scatter_ns_(tolerance_ns_ / kUsualTimes) {}

auto ClockRegulator::feed(const ReferencePair& pair) noexcept -> Verdict {
  if (pair.reference_ns > kMaxReferenceNs || pair.reference_ns < -kMaxReferenceNs) {
    return Verdict::out_of_range;
  }
  if (pairs_ == 0) {
    begin(pair);
    return Verdict::taken;
  }
  const Duration elapsed = pair.local - model_.local;
  if (elapsed <= Duration::zero()) return Verdict::out_of_order;
  if (elapsed < kMinSpacing) return Verdict::skipped;
  // Of two whole numbers first: a double has not enough digits for a date.
  const std::int64_t expected = wrapping_sum(model_.reference_ns, elapsed.count());
  const double error_ns =
      static_cast<double>(wrapping_difference(pair.reference_ns, expected)) - model_.excess_ns(elapsed);
  if (std::abs(error_ns) > limit_ns(elapsed)) return leave_out(pair, error_ns);
  widen(error_ns);
  outliers_ = 0;
  if (elapsed > gap_) pairs_ = std::min(pairs_, kPairsAfterStep);
  model_.move_to(pair.local);
  take(error_ns, elapsed);
  return Verdict::taken;
}

void ClockRegulator::begin(const ReferencePair& pair) noexcept {
  model_ = {.local = pair.local, .reference_ns = pair.reference_ns};
  pairs_ = 1;
  bias_ns_ = 0;
}

// The line has been moved to the pair's time already.
void ClockRegulator::take(double error_ns, Duration elapsed) noexcept {
  pairs_ = std::min(pairs_ + 1, kEnoughPairs);
  const double n = pairs_;
  const double kp = std::max(2 * (2 * n - 1) / (n * (n + 1)), kp_);
  const double ki = std::max(6 / (n * (n + 1)), ki_);
  model_.fraction_ns += kp * error_ns;
  // Of two pairs that come close together, as a writer that was late gives them, the noise is no drift.
  const auto apart = static_cast<double>(std::min(elapsed, gap_).count());
  spacing_ns_ = spacing_ns_ > 0 ? spacing_ns_ + (apart - spacing_ns_) / std::min(n, kAveragedPairs) : apart;
  const double base = std::max(static_cast<double>(elapsed.count()), spacing_ns_);
  model_.drift = std::clamp(model_.drift + ki * error_ns / base, -kMaxDrift, kMaxDrift);
  bias_ns_ += (error_ns - bias_ns_) / std::min(n, kAveragedPairs);
  if (n > 2 * kAveragedPairs && std::abs(bias_ns_) > kOneSided * scatter_ns_) {
    pairs_ = kPairsAfterChange;
  }
}

void ClockRegulator::widen(double error_ns) noexcept {
  const double clipped = std::min(std::abs(error_ns), kScatterClip * std::max(scatter_ns_, 1.0));
  scatter_ns_ += (clipped - scatter_ns_) / kAveragedPairs;
}

double ClockRegulator::noise_ns() const noexcept {
  return std::clamp(kUsualTimes * scatter_ns_, tolerance_ns_, tolerance_ns_ + kWidestNoiseNs);
}

// A silence that goes on allows no more: a clock that is far off after it has to show first that it is one.
double ClockRegulator::limit_ns(Duration elapsed) const noexcept {
  const double drift = usable() ? kDriftChange : kMaxDrift;
  return noise_ns() + drift * static_cast<double>(std::min(elapsed, gap_).count());
}

// Outliers alone say little of the noise: a reference that stands still has nothing else. Noise lies on both
// sides of the line and not just anywhere. While the line is not known yet, what lies anywhere makes it
// doubtful.
auto ClockRegulator::leave_out(const ReferencePair& pair, double error_ns) noexcept -> Verdict {
  const bool near =
      std::max(std::abs(error_ns), std::abs(last_outlier_ns_)) <= tolerance_ns_ + kWidestNoiseNs;
  if (near && std::signbit(error_ns) != std::signbit(last_outlier_ns_)) widen(error_ns);
  if (!near && !usable() && pairs_ > 1) --pairs_;
  last_outlier_ns_ = error_ns;
  const auto since = static_cast<double>((pair.local - run_began_).count());
  const double change = error_ns - run_error_ns_;
  const double ahead = change + model_.drift * since;  // of the local clock
  if (outliers_ == 0 || since <= 0 || std::abs(ahead) > noise_ns() + kMaxDrift * since) {
    outliers_ = 1;
    run_began_ = pair.local;
    run_error_ns_ = error_ns;
    return Verdict::outlier;
  }
  ++outliers_;
  if (outliers_ < kStepPairs || since < kTimesNoise * noise_ns()) return Verdict::outlier;
  step_to(pair, std::abs(change) > noise_ns() + kDriftChange * since ? ahead / since : model_.drift);
  return Verdict::stepped;
}

void ClockRegulator::step_to(const ReferencePair& pair, double drift) noexcept {
  outliers_ = 0;
  model_ = {.local = pair.local,
            .reference_ns = pair.reference_ns,
            .drift = std::clamp(drift, -kMaxDrift, kMaxDrift)};
  pairs_ = std::min(pairs_, kPairsAfterStep);
  bias_ns_ = 0;
}

}  // namespace plchost
