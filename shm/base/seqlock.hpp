#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <type_traits>

namespace plchost {

/// A value with one writer and any number of readers, in shared memory: the writer never waits, and readers
/// never disturb it. All zero is valid and holds an all-zero value.
template <class T>
  requires std::is_trivially_copyable_v<T>
class Seqlock {
 public:
  /// Real-time. One writer only.
  void write(const T& value) noexcept {
    std::array<std::uint64_t, kWords> words{};
    std::memcpy(words.data(), &value, sizeof(T));
    // Odd if a stranger has written over it: then readers would take every second write for a whole one.
    const std::uint64_t sequence = (sequence_.load(std::memory_order_relaxed) + 1) & ~std::uint64_t{1};
    sequence_.store(sequence + 1, std::memory_order_relaxed);
    // Pairs with the acquire fence in read(): a reader that sees a new word sees the odd sequence.
    std::atomic_thread_fence(std::memory_order_release);
    for (std::size_t i = 0; i < kWords; ++i) words_[i].store(words[i], std::memory_order_relaxed);
    sequence_.store(sequence + 2, std::memory_order_release);
  }

  /// A consistent copy, or nothing if the writer was in the way each time (or ended while writing).
  [[nodiscard]] std::optional<T> read(int attempts = 100) const noexcept {
    for (int i = 0; i < attempts; ++i) {
      const std::uint64_t before = sequence_.load(std::memory_order_acquire);
      if ((before & 1) != 0) continue;
      std::array<std::uint64_t, kWords> words{};
      for (std::size_t w = 0; w < kWords; ++w) words[w] = words_[w].load(std::memory_order_relaxed);
      std::atomic_thread_fence(std::memory_order_acquire);
      if (sequence_.load(std::memory_order_relaxed) != before) continue;
      T value;
      std::memcpy(static_cast<void*>(&value), words.data(), sizeof(T));
      return value;
    }
    return std::nullopt;
  }

  /// Whether there was a write since it was all zero.
  [[nodiscard]] bool is_written() const noexcept { return sequence() != 0; }

  /// Changes with every write: equal numbers mean that nothing was written in between.
  [[nodiscard]] std::uint64_t sequence() const noexcept { return sequence_.load(std::memory_order_acquire); }

  /// Makes the lock usable again after a writer that ended inside write(). Before the new writer's first
  /// write.
  void recover() noexcept {
    const std::uint64_t sequence = sequence_.load(std::memory_order_relaxed);
    if ((sequence & 1) != 0) sequence_.store(sequence + 1, std::memory_order_release);
  }

 private:
  static constexpr std::size_t kWords = (sizeof(T) + 7) / 8;

  std::atomic<std::uint64_t> sequence_{0};
  std::array<std::atomic<std::uint64_t>, kWords> words_{};
};

}  // namespace plchost
