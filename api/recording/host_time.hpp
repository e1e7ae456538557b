#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "shm/base/time.hpp"

namespace plchost {

/// Maps CLOCK_MONOTONIC of a host to that of this process.
struct HostTime {
  std::int64_t at_ns = 0;           ///< of the host: there the offset is exactly `offset_ns`
  std::int64_t offset_ns = 0;       ///< the host's clock is so far ahead
  std::int64_t uncertainty_ns = 0;  ///< the offset is wrong by no more
  double drift = 0;                 ///< the offset grows by so much each ns

  [[nodiscard]] std::int64_t here(std::int64_t host_ns) const noexcept;
};

/// Finds it from requests that the host has answered with its time. The time was read somewhere between the
/// request and its answer, so the fastest of them are the best.
class HostTimeSamples {
 public:
  /// Times that no clock has count for nothing.
  void add(TimePoint asked, TimePoint answered, std::int64_t host_ns);
  /// Nothing: there is no sample. If the fastest of the first half and of the second differ by more than
  /// both can be wrong, the clocks drift.
  [[nodiscard]] std::optional<HostTime> result() const;

 private:
  struct Sample {
    std::int64_t host_ns;
    std::int64_t offset_ns;
    std::int64_t uncertainty_ns;
  };
  std::vector<Sample> samples_;
};

}  // namespace plchost
