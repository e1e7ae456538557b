#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "schedulers/faults/processor_times.hpp"

namespace plchost {

/// Finds the threads of this process that take the processor by a real-time priority: by what each uses
/// between two moments. One thread at a time; real-time.
class TakerSearch {
 public:
  /// So far apart the two moments are.
  static constexpr Duration kLength = std::chrono::milliseconds(50);
  /// More threads with a real-time priority than that are not looked at.
  static constexpr std::size_t kMost = 256;

  explicit TakerSearch(const ProcessorTimes& times) noexcept : times_(times) {}

  void begin(TimePoint now) noexcept;
  [[nodiscard]] bool begun() const noexcept { return begun_; }
  /// When it is to be ended at the earliest.
  [[nodiscard]] TimePoint ends() const noexcept { return began_ + kLength; }
  void forget() noexcept { begun_ = false; }
  /// Takes their real-time priority from all threads that have used more than a tenth of the time since it
  /// was begun, but for `spared`. Which of them has used the most; empty: there is none.
  [[nodiscard]] ThreadText end(TimePoint now, std::span<const pid_t> spared) noexcept;

 private:
  struct Thread {
    pid_t id = 0;
    Duration used{};
  };

  const ProcessorTimes& times_;
  bool begun_ = false;
  TimePoint began_;
  std::array<Thread, kMost> threads_{};
  std::size_t count_ = 0;
};

}  // namespace plchost
