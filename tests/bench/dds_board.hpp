#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace plchost::bench {

/// Shared by the benchmark and the program that runs in the measured instance. All zero is valid and empty.
struct DdsBoard {
  static constexpr std::uint32_t kCapacity = 1U << 20;
  std::atomic<std::int64_t> posted_ns;     ///< CLOCK_MONOTONIC just before the post
  std::atomic<std::uint32_t> arrived;      ///< posts whose task ran
  std::array<std::int64_t, kCapacity> latency_ns;
};

/// The environment variable that names the board's file.
inline constexpr const char* kBoardVariable = "PLCHOST_BENCH_BOARD";

}  // namespace plchost::bench
