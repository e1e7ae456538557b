#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace plchost::models {

/// Hashes of states, each with the threads that need not run first there.
class StateMap {
 public:
  StateMap() : slots_(1U << 16U) {}

  struct Entry {
    std::uint64_t state = 0;
    std::uint8_t asleep = 0;
  };
  /// The entry of that state; `fresh`: it was not in, and is now.
  Entry& find(std::uint64_t state, bool& fresh) {
    if (state == 0) state = 1;
    if (size_ * 2 > slots_.size()) grow();
    Entry& entry = place(state);
    fresh = entry.state == 0;
    if (fresh) {
      entry.state = state;
      ++size_;
    }
    return entry;
  }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }

 private:
  Entry& place(std::uint64_t state) {
    for (std::size_t at = state >> 8U;; ++at) {
      Entry& entry = slots_[at & (slots_.size() - 1)];
      if (entry.state == state || entry.state == 0) return entry;
    }
  }
  void grow() {
    std::vector<Entry> before(slots_.size() * 2);
    before.swap(slots_);
    for (const Entry& entry : before) {
      if (entry.state != 0) place(entry.state) = entry;
    }
  }

  std::vector<Entry> slots_;
  std::size_t size_ = 0;
};

}  // namespace plchost::models
