#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace plchost {

/// Puts bytes into a variable of the application. One of 1, 2, 4 or 8 bytes that is aligned changes as a
/// whole: a thread of the application may read it. Real-time.
inline void store_value(std::byte* to, std::span<const std::byte> bytes) noexcept {
  const auto whole = [&]<class Word>(Word word) {
    std::memcpy(&word, bytes.data(), sizeof word);
    __atomic_store_n(reinterpret_cast<Word*>(to), word, __ATOMIC_RELAXED);
  };
  const bool aligned = (reinterpret_cast<std::uintptr_t>(to) & (bytes.size() - 1)) == 0;  // of a power of two
  if (bytes.size() == sizeof(std::uint8_t)) return whole(std::uint8_t{});
  if (aligned && bytes.size() == sizeof(std::uint16_t)) return whole(std::uint16_t{});
  if (aligned && bytes.size() == sizeof(std::uint32_t)) return whole(std::uint32_t{});
  if (aligned && bytes.size() == sizeof(std::uint64_t)) return whole(std::uint64_t{});
  // Another task may have written the same bytes.
  if (std::memcmp(to, bytes.data(), bytes.size()) != 0) std::memcpy(to, bytes.data(), bytes.size());
}

/// The forced variables of one task. Made by the control thread, and never changed.
class ForceList {
 public:
  void add(std::byte* address, std::span<const std::byte> value) {
    forces_.push_back({.address = address, .offset = values_.size(), .bytes = value.size()});
    values_.insert(values_.end(), value.begin(), value.end());
  }
  [[nodiscard]] bool empty() const noexcept { return forces_.empty(); }
  /// Real-time.
  void apply() const noexcept {
    for (const Force& force : forces_)
      store_value(force.address, std::span(values_).subspan(force.offset, force.bytes));
  }

 private:
  struct Force {
    std::byte* address;
    std::size_t offset;  // of its value in values_
    std::size_t bytes;
  };
  std::vector<Force> forces_;
  std::vector<std::byte> values_;
};

/// Where the cycles of a task find its forces. The list is exchanged while no task is within a cycle.
struct ForceSlot {
  const ForceList* list = nullptr;  ///< null: there is none

  /// Real-time.
  void apply() const noexcept {
    if (list != nullptr) list->apply();
  }
};

}  // namespace plchost
