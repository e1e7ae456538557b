#pragma once

#include <cstdint>

#include "schedulers/distributed_clock/clock_model.hpp"

namespace plchost {

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
