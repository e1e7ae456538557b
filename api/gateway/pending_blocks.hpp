#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "shm/base/time.hpp"
#include "shm/block_driver/block_node.hpp"

namespace plchost {

/// Blocks from other hosts, on their way into this one. Those whose queue is full, or whose link is being
/// made, wait here, in order, each node and priority by itself. One thread.
class PendingBlocks {
 public:
  using Inject = std::function<SendResult(const BlockHeader&, std::span<const std::byte>)>;
  /// From so many that wait on, a node is full: others are asked not to send more.
  static constexpr std::size_t kFull = 64;
  /// More than that are dropped: bytes of all that wait, and blocks for one node of one priority.
  static constexpr std::size_t kMostBytes = std::size_t{8} << 20;
  static constexpr std::size_t kMostBlocks = 2048;

  /// Counts in `counters` what is dropped: after `hold`, or because it does not fit, or because there is
  /// nobody.
  PendingBlocks(Inject inject, Duration hold, NodeCounters& counters)
      : inject_(std::move(inject)), hold_(hold), counters_(counters) {}

  void take(const BlockHeader& header, std::span<const std::byte> contents, TimePoint now);
  void retry(TimePoint now);

  [[nodiscard]] bool empty() const noexcept { return ways_.empty(); }
  /// The nodes that take no more at present.
  [[nodiscard]] NodeSet full() const noexcept;

 private:
  struct Waiting {
    BlockHeader header;
    std::vector<std::byte> contents;
    TimePoint since;
  };
  using Way = std::pair<std::uint16_t, std::uint8_t>;  // node, priority
  /// Whether it is done with, one way or the other.
  bool put(const BlockHeader& header, std::span<const std::byte> contents);

  Inject inject_;
  Duration hold_;
  NodeCounters& counters_;
  std::map<Way, std::deque<Waiting>> ways_;  // none is empty
  std::size_t bytes_ = 0;
};

}  // namespace plchost
