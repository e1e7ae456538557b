#pragma once

#include "tests/bench/bench.hpp"
#include "tests/bench/dds_board.hpp"

namespace plchost::bench {

/// The two domains of a measurement: plchost's, and the bare one of the floor.
struct DdsDomains {
  std::uint32_t plchost = 0;
  std::uint32_t bare = 0;
};

inline constexpr const char* kBenchHost = "bench";

/// The poster process: obeys the board until it says end. Returns its exit code.
[[nodiscard]] int run_dds_poster(const Plan& plan, const DdsDomains& domains, DdsBoard& board);

}  // namespace plchost::bench
