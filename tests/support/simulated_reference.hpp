#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include "schedulers/distributed_clock/reference_source.hpp"

namespace plchost {

/// A reference clock that a test invents: a line against the local clock, with seeded noise on what is
/// stamped.
class SimulatedReference {
 public:
  static constexpr std::int64_t kEpoch = 800'000'000'000'000'000;  // as EtherCAT's, 25 years after its zero

  SimulatedReference(TimePoint origin, double drift, double noise_ns, std::uint64_t seed = 1)
      : anchor_(origin), at_anchor_(0), drift_(drift), noise_(-noise_ns, noise_ns), random_(seed) {}

  /// What it shows without noise, beyond kEpoch, in nanoseconds.
  [[nodiscard]] double beyond_epoch(TimePoint when) const {
    return at_anchor_ + static_cast<double>((when - anchor_).count()) * (1 + drift_);
  }
  [[nodiscard]] ReferencePair stamp(TimePoint when) {
    return {.local = when, .reference_ns = kEpoch + std::llround(beyond_epoch(when) + noise_(random_))};
  }
  /// How far `release` lies behind the point `offset` of its grid.
  [[nodiscard]] double deviation_ns(TimePoint release, Duration interval, Duration offset = {}) const {
    const auto period = static_cast<double>(interval.count());
    const double since =
        beyond_epoch(release) + static_cast<double>(kEpoch % interval.count() - offset.count());
    return since - std::round(since / period) * period;
  }

  void set_drift(double drift, TimePoint from) {
    at_anchor_ = beyond_epoch(from);
    anchor_ = from;
    drift_ = drift;
  }
  void step(Duration by) { at_anchor_ += static_cast<double>(by.count()); }

 private:
  TimePoint anchor_;
  double at_anchor_;
  double drift_;
  std::uniform_real_distribution<double> noise_;
  std::mt19937_64 random_;
};

/// A record that a test fills.
class FakeRecord final : public ReferenceSource {
 public:
  void write(const ReferencePair& pair) {
    reading_ = {.outcome = Outcome::pair, .pair = pair, .updates = reading_.updates + 1};
  }
  void write_invalid() {
    reading_ = {.outcome = Outcome::invalid, .pair = {}, .updates = reading_.updates + 1};
  }
  void corrupt() { reading_.outcome = Outcome::corrupt; }
  [[nodiscard]] Reading read() noexcept override { return reading_; }

 private:
  Reading reading_;
};

}  // namespace plchost
