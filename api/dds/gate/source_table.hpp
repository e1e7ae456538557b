#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "api/dds/gate/submessage.hpp"
#include "shm/base/time.hpp"

namespace plchost::dds {

/// Remembers from which port of this machine each participant sends, so that no other process speaks in its
/// name. An unsecured host cannot tell a forged message otherwise. One heartbeat with a number that is too
/// high makes Cyclone drop all later samples of the real sender. The first datagram of a participant decides.
/// It is forgotten kForgotten after its last datagram.
///
/// Bounded: of more than kSets * kWays participants, the one that has been silent for longest goes, and one
/// that was heard only once goes before all that were heard again. One thread.
class SourceTable {
 public:
  static constexpr std::size_t kSets = 512;
  static constexpr std::size_t kWays = 8;
  static constexpr std::chrono::seconds kForgotten{10};

  SourceTable() : entries_(kSets * kWays) {}

  /// Whether a datagram with this prefix in its header may come from this port.
  [[nodiscard]] bool is_its_own(std::span<const std::byte, kGuidPrefix> guid_prefix, std::uint16_t port,
                                TimePoint now) noexcept;

 private:
  struct Entry {
    std::array<std::byte, kGuidPrefix> guid_prefix{};
    std::uint16_t port = 0;  ///< 0: free
    bool heard_again = false;
    TimePoint last{};
  };

  std::vector<Entry> entries_;
};

}  // namespace plchost::dds
