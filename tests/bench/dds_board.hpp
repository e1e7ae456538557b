#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace plchost::bench {

/// Shared by the benchmark, its poster process, and the program that runs in the measured instance. All zero
/// is valid and empty.
struct DdsBoard {
  static constexpr std::uint32_t kCapacity = 1U << 20;
  std::atomic<std::int64_t> posted_ns;      ///< CLOCK_MONOTONIC just before the post
  std::atomic<std::uint32_t> arrived;       ///< posts whose task ran
  std::atomic<std::uint32_t> posts;         ///< how many the poster shall make in this slice
  std::atomic<std::uint32_t> order;         ///< an Order for the poster
  std::atomic<std::uint32_t> poster_ready;  ///< 1: both ways are open; 2: they cannot be opened
  std::array<std::int64_t, kCapacity> latency_ns;

  void record(std::int64_t now_ns) noexcept {
    const std::uint32_t index = arrived.load(std::memory_order_relaxed);
    latency_ns[index % kCapacity] = now_ns - posted_ns.load(std::memory_order_relaxed);
    arrived.store(index + 1, std::memory_order_release);
  }
};

enum class Order : std::uint32_t { wait = 0, post_bare = 1, post_event = 2, end = 3 };

}  // namespace plchost::bench
