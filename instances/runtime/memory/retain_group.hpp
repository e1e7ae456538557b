#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "instances/runtime/memory/task_areas.hpp"

namespace plchost {

/// Retain data that the same tasks may change, and the way to a copy that shows none of these tasks within a
/// cycle. There may nearly always be one: so a task that has come to the end of its cycle makes the copy.
class RetainGroup {
 public:
  /// A stretch of the data, and where it lies while the application runs.
  struct Part {
    std::size_t offset = 0;
    std::span<const std::byte> live;
  };
  /// `counters`: of the tasks; none: nobody changes the data.
  RetainGroup(std::vector<const CycleCounter*> counters, std::vector<Part> parts)
      : counters_(std::move(counters)), parts_(std::move(parts)) {}

  [[nodiscard]] const std::vector<Part>& parts() const noexcept { return parts_; }
  [[nodiscard]] const std::vector<const CycleCounter*>& counters() const noexcept { return counters_; }

  /// Asks the tasks to copy the data to where they belong in `copy`. Soft thread.
  void ask(std::span<std::byte> copy) noexcept;
  /// It was done, or could be done now. Soft thread.
  [[nodiscard]] bool is_answered() noexcept;
  /// Nobody writes into the copy any more. False: it was not done. Soft thread.
  bool withdraw() noexcept;

  /// For a task of the group that has ended its cycle: copies if that was asked for and no other task is
  /// within one. `may_wait`: it is not real-time, and waits up to 20 ms for the others. Else real-time: no
  /// lock, no system call, as long as it takes to copy the parts, at most three times.
  /// false: nobody has asked.
  bool answer(bool may_wait) noexcept {
    if (state_.load(std::memory_order_relaxed) != State::asked) return false;
    answer_now(may_wait);
    return true;
  }

 private:
  enum class State : std::uint8_t { idle, asked, copying, done };
  [[nodiscard]] bool begin_copy() noexcept;
  void end_copy(bool done) noexcept;
  [[nodiscard]] bool copy() const noexcept;
  void answer_now(bool may_wait) noexcept;

  std::vector<const CycleCounter*> counters_;
  std::vector<Part> parts_;
  std::span<std::byte> copy_;  // belongs to the thread that has made `copying` of the state
  std::atomic<State> state_{State::idle};
};

/// Copies what others may be writing at this moment: then the copy is worth nothing, and thrown away.
void copy_moving(std::byte* to, const std::byte* from, std::size_t bytes) noexcept;

}  // namespace plchost
