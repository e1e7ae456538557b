#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>

#include "shm/base/time.hpp"

namespace plchost {

/// How much may be on its way to another host: so a host that takes nothing is felt by those who send, and
/// holds up nobody else. One thread at a time.
class BlockWindow {
 public:
  static constexpr std::size_t kMostBlocks = 1024;
  static constexpr std::size_t kMostBytes = std::size_t{2} << 20;
  /// Blocks that have not been acknowledged for so long, by a host that is heard, are lost.
  static constexpr Duration kPatience = std::chrono::seconds(1);

  /// Of contents. An empty window has room for any block.
  [[nodiscard]] bool has_room(std::size_t bytes) const noexcept {
    return sizes_.size() < kMostBlocks && (sizes_.empty() || bytes_ + bytes <= kMostBytes);
  }
  /// The number of the next block.
  [[nodiscard]] std::uint64_t next() const noexcept { return acknowledged_ + sizes_.size() + 1; }
  /// The next block is on its way.
  void add(std::size_t bytes, TimePoint now) {
    if (sizes_.empty()) progress_ = now;
    sizes_.push_back(bytes);
    bytes_ += bytes;
  }
  /// All up to this number have been taken. An impossible number is ignored. Whether that is news.
  bool acknowledge(std::uint64_t number, TimePoint now) {
    if (number <= acknowledged_ || number >= next()) return false;
    for (; acknowledged_ < number; ++acknowledged_) {
      bytes_ -= sizes_.front();
      sizes_.pop_front();
    }
    progress_ = now;
    return true;
  }
  /// A block waits for its acknowledgement for kPatience.
  [[nodiscard]] bool stalled(TimePoint now) const noexcept {
    return !sizes_.empty() && now - progress_ > kPatience;
  }
  /// kPatience begins again.
  void be_patient(TimePoint now) noexcept { progress_ = now; }
  [[nodiscard]] std::size_t under_way() const noexcept { return sizes_.size(); }

 private:
  std::deque<std::size_t> sizes_;  // of the blocks after acknowledged_
  std::size_t bytes_ = 0;
  std::uint64_t acknowledged_ = 0;
  TimePoint progress_;
};

}  // namespace plchost
