#pragma once

#include <atomic>

namespace plchost {

/// A thread's word for the table that it looks at, so that another one can exchange tables meanwhile. That
/// one puts the new table in. It frees the one before when no thread holds it any more. Real-time.
template <class Table>
class TableHold {
 public:
  /// The table of now, which stays until let_go(); null: there is none. The thread itself.
  [[nodiscard]] const Table* take(const std::atomic<const Table*>& current) noexcept {
    for (;;) {
      const Table* const table = current.load(std::memory_order_seq_cst);
      // Either the one who frees sees this word, or this thread sees that the table was exchanged.
      held_.store(table, std::memory_order_seq_cst);
      if (current.load(std::memory_order_seq_cst) == table) return table;
    }
  }
  void let_go() noexcept { held_.store(nullptr, std::memory_order_release); }
  /// It may look at that table. The one who has taken it out of `current`.
  [[nodiscard]] bool holds(const Table* table) const noexcept {
    return held_.load(std::memory_order_seq_cst) == table;
  }

 private:
  std::atomic<const Table*> held_{nullptr};
};

}  // namespace plchost
