#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "shm/base/time.hpp"

namespace plchost {

/// The tasks to come, the earliest first: a binary heap whose entries know their place, so that one that is
/// in it can be moved or taken out. Allocates in reserve() only. One thread.
class DueQueue {
 public:
  /// Base of what is queued; in at most one queue.
  class Entry {
    friend class DueQueue;
    std::size_t place_ = kNowhere;
  };

  /// Set-up: room for `count` entries.
  void reserve(std::size_t count) { nodes_.reserve(count); }
  [[nodiscard]] std::size_t size() const noexcept { return nodes_.size(); }

  /// Queues `entry` for `due`, or moves it there if it is in already. O(log n). Real-time.
  void put(Entry& entry, Duration::rep due) noexcept;
  /// Nothing if it is not in. O(log n). Real-time.
  void remove(Entry& entry) noexcept;
  /// Takes out the earliest entry that is due at `now`; null: none is. O(log n). Real-time.
  [[nodiscard]] Entry* take_due(Duration::rep now) noexcept;

 private:
  static constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();
  struct Node {
    Duration::rep due;
    Entry* entry;
  };

  void set(std::size_t place, const Node& node) noexcept;
  void settle(std::size_t place, const Node& node) noexcept;

  std::vector<Node> nodes_;
};

}  // namespace plchost
