#include "instances/runtime/application/message_queue.hpp"

#include <cstring>

#include "instances/plc_app.h"

namespace plchost {

static_assert(MessageQueue::kMaxText == PLC_LOG_MAX_TEXT);

// A cell's ticket is n when the n-th message may be written there, n + 1 when it is there to be read.
MessageQueue::MessageQueue() noexcept {
  for (std::size_t i = 0; i < kCapacity; ++i) cells_[i].ticket.store(i, std::memory_order_relaxed);
}

bool MessageQueue::push(int level, const char* text) noexcept {
  // Before a cell is taken: a faulty pointer must not leave one that nobody ever fills.
  std::array<char, kMaxText> copy;
  const std::size_t length = ::strnlen(text, kMaxText);
  std::memcpy(copy.data(), text, length);
  std::uint64_t mine = write_.load(std::memory_order_relaxed);
  for (;;) {
    // Acquire pairs with the release in drain(): the reader is done with the cell.
    const std::uint64_t ticket = cells_[mine % kCapacity].ticket.load(std::memory_order_acquire);
    if (ticket < mine) {
      dropped_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    if (ticket > mine) {
      mine = write_.load(std::memory_order_relaxed);
    } else if (write_.compare_exchange_weak(mine, mine + 1, std::memory_order_relaxed)) {
      break;
    }
  }
  Cell& cell = cells_[mine % kCapacity];
  cell.level = level;
  cell.length = length;
  std::memcpy(cell.text.data(), copy.data(), length);
  cell.ticket.store(mine + 1, std::memory_order_release);  // pairs with the acquire in drain()
  return true;
}

void MessageQueue::drain(const std::function<void(int, std::string_view)>& write) {
  // At most one round, so that busy writers cannot keep the control thread here.
  for (std::size_t i = 0; i < kCapacity; ++i) {
    Cell& cell = cells_[read_ % kCapacity];
    if (cell.ticket.load(std::memory_order_acquire) != read_ + 1) return;
    write(cell.level, std::string_view(cell.text.data(), cell.length));
    cell.ticket.store(read_ + kCapacity, std::memory_order_release);
    ++read_;
  }
}

}  // namespace plchost
