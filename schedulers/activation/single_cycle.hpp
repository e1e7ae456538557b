#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <vector>

#include "schedulers/tasks/activation_gate.hpp"
#include "schedulers/tasks/task.hpp"

namespace plchost {

/// One cycle of each of some tasks, one after the other: a task that comes back from its cycle releases the
/// next. No scheduler takes part, so it is the same under each.
class SingleCycle {
 public:
  explicit SingleCycle(Clock& clock) noexcept : clock_(clock) {}

  /// The source of the next task in the order. Set-up, before begin(). It uses this object.
  [[nodiscard]] std::unique_ptr<ActivationSource> add();
  /// Releases the first. All of their threads have their sources.
  void begin() noexcept;
  /// The task whose turn it is, in the order of add(); the number of tasks: all have come back. Any thread.
  [[nodiscard]] std::size_t turn() const noexcept { return turn_.load(std::memory_order_acquire); }
  /// Number `link` will not come back; does nothing unless it is its turn. Any thread.
  void skip(std::size_t link) noexcept { came_back(link); }
  /// Number `link` has begun its cycle. Any thread.
  [[nodiscard]] bool has_begun(std::size_t link) const noexcept {
    return links_[link]->begun.load(std::memory_order_acquire);
  }

 private:
  class Source;
  struct Link {
    ActivationGate gate;
    std::atomic<Duration::rep> released_at{0};
    std::atomic<bool> begun{false};
  };

  void release(std::size_t link) noexcept;
  void came_back(std::size_t link) noexcept;

  Clock& clock_;
  std::vector<std::unique_ptr<Link>> links_;
  std::atomic<std::size_t> turn_{0};
};

}  // namespace plchost
