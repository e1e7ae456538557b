#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string_view>

namespace plchost {

/// The way of plc_log's lines from any thread to the control thread: a bounded queue, any number of writers
/// that never wait, one reader. Each cell carries the ticket of its next user (Vyukov's scheme).
class MessageQueue {
 public:
  static constexpr std::size_t kCapacity = 256;  // a power of two
  static constexpr std::size_t kMaxText = 200;   // PLC_LOG_MAX_TEXT

  MessageQueue() noexcept;

  /// Any context, real-time included. A longer text is cut. False: the queue is full; that is counted.
  bool push(int level, const char* text) noexcept;

  /// Hands over what is there. Control thread only.
  void drain(const std::function<void(int level, std::string_view text)>& write);

  /// Messages that found no room since the last call.
  [[nodiscard]] std::uint64_t take_dropped() noexcept {
    return dropped_.exchange(0, std::memory_order_relaxed);
  }

 private:
  struct Cell {
    std::atomic<std::uint64_t> ticket;
    int level = 0;
    std::size_t length = 0;
    std::array<char, kMaxText> text{};
  };

  std::array<Cell, kCapacity> cells_{};
  std::atomic<std::uint64_t> write_{0};
  std::uint64_t read_ = 0;
  std::atomic<std::uint64_t> dropped_{0};
};

}  // namespace plchost
