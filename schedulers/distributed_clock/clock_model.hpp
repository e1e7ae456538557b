#pragma once

#include <cmath>
#include <cstdint>

#include "shm/base/time.hpp"
#include "shm/base/wrapping.hpp"

namespace plchost {

/// Both clocks at the same instant, as a program that sees both has stamped them.
struct ReferencePair {
  TimePoint local;
  std::int64_t reference_ns = 0;
};

/// The time of the reference clock at a local time: a straight line. The fraction of a nanosecond and the
/// slope are floating-point because a drift of 1e-9 is no whole number of anything; times stay whole numbers.
struct ClockModel {
  TimePoint local;                ///< where the line is anchored
  std::int64_t reference_ns = 0;  ///< the reference's time there
  double fraction_ns = 0;         ///< and this much more
  double drift = 0;               ///< how much faster the reference runs: 1e-6 is 1 ppm

  /// Nanoseconds of reference time that pass beyond the `elapsed` of local time, and the anchor's fraction.
  [[nodiscard]] double excess_ns(Duration elapsed) const noexcept {
    return fraction_ns + drift * static_cast<double>(elapsed.count());
  }
  /// The reference time at `when`, rounded. Wraps around where the reference's range ends.
  [[nodiscard]] std::int64_t reference_at(TimePoint when) const noexcept {
    const Duration elapsed = when - local;
    return wrapping_sum(reference_ns, elapsed.count() + std::llround(excess_ns(elapsed)));
  }
  /// Moves the anchor along the line.
  void move_to(TimePoint when) noexcept {
    const Duration elapsed = when - local;
    const double excess = excess_ns(elapsed);
    const double whole = std::floor(excess);
    reference_ns = wrapping_sum(reference_ns, elapsed.count() + static_cast<std::int64_t>(whole));
    fraction_ns = excess - whole;
    local = when;
  }
};

/// Where pairs of stamps come from: a record that firmware writes, or a test.
class ReferenceSource {
 public:
  enum class Outcome : std::uint8_t {
    nothing,  ///< nothing was ever written, or it is being written just now
    pair,
    invalid,  ///< the writer says that its clock does not hold
    corrupt,  ///< nothing that a writer of ours has written
  };
  struct Reading {
    Outcome outcome = Outcome::nothing;
    ReferencePair pair;
    std::uint64_t updates = 0;  ///< the same number as before: the same reading as before
  };

  virtual ~ReferenceSource() = default;
  /// The newest one. Real-time; one thread at a time.
  [[nodiscard]] virtual Reading read() noexcept = 0;
};

}  // namespace plchost
