#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include "schedulers/distributed_clock/clock_model.hpp"
#include "shm/base/seqlock.hpp"

namespace plchost {

/// A reference clock that a test invents: a line against the local clock, with seeded noise on what is
/// stamped.
class SimulatedReference {
 public:
  static constexpr std::int64_t kEpoch = 800'000'000'000'000'000;  // as EtherCAT's, 25 years after its zero

  SimulatedReference(TimePoint origin, double drift, double noise_ns, std::uint64_t seed = 1)
      : anchor_(origin), at_anchor_(0), drift_(drift), noise_(-noise_ns, noise_ns), random_(seed) {}

  /// Its time without noise, beyond kEpoch, in nanoseconds.
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

/// A record that a test fills, from one thread; the tasks that follow it read it from theirs.
class FakeRecord final : public ReferenceSource {
 public:
  void write(const ReferencePair& pair) { publish(Outcome::pair, pair); }
  void write_invalid() { publish(Outcome::invalid, {}); }
  void corrupt() { reading_.write({.outcome = Outcome::corrupt, .pair = {}, .updates = updates_}); }
  [[nodiscard]] Reading read() noexcept override { return reading_.read().value_or(Reading{}); }

 private:
  void publish(Outcome outcome, const ReferencePair& pair) {
    reading_.write({.outcome = outcome, .pair = pair, .updates = ++updates_});
  }

  Seqlock<Reading> reading_;
  std::uint64_t updates_ = 0;
};

}  // namespace plchost
