#pragma once

#include <array>
#include <cstdint>

#include "shm/block_driver/block.hpp"

namespace plchost {

/// Remembers which blocks for all nodes have come already. Bounded: of the newest sources, and
/// of each and each priority (one overtakes the other) the last 64 numbers. One soft thread.
class DuplicateFilter {
 public:
  static constexpr std::size_t kSources = 256;
  static constexpr std::uint32_t kWindow = 64;

  /// Whether this one has not come before; remembers it. One that is older than the window of its source
  /// counts as a duplicate.
  [[nodiscard]] bool first_time(const BlockHeader& header) noexcept;

 private:
  struct Source {
    std::uint32_t address = 0;  // 0: free
    std::uint8_t priority = 0;
    std::uint32_t epoch = 0;
    std::uint32_t newest = 0;
    std::uint64_t seen = 0;  // bit N: newest - N has come
    std::uint64_t used = 0;  // when, for replacing the oldest
  };
  Source& source_of(const BlockHeader& header) noexcept;

  std::array<Source, kSources> sources_{};
  std::uint64_t turn_ = 0;
};

}  // namespace plchost
