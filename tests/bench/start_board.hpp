#pragma once

#include <atomic>
#include <cstdint>

namespace plchost::bench {

/// Shared by the benchmark and a program whose start it measures. All zero is valid and empty.
struct StartBoard {
  std::atomic<std::int64_t> first_cycle_ns;  ///< CLOCK_MONOTONIC of the first cycle

  void record(std::int64_t now_ns) noexcept {
    std::int64_t none = 0;
    first_cycle_ns.compare_exchange_strong(none, now_ns);
  }
};

}  // namespace plchost::bench
