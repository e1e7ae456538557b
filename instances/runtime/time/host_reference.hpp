#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "instances/runtime/settings/reference_name.hpp"
#include "instances/runtime/time/clock_system.hpp"
#include "instances/runtime/time/host_clock.hpp"
#include "instances/runtime/time/reference.hpp"
#include "shm/base/seqlock.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

/// A clock of the host: a soft thread reads it and leaves pairs for the tasks, so that no cycle makes a
/// system call.
class HostReference final : public Reference {
 public:
  /// `name` is no record. `system` outlives it.
  HostReference(DistributedClock& clock, ClockSystem& system, ReferenceName name, Duration period);
  ~HostReference() override;

  void refresh() override;

  /// How often the clock is read: ten times in the timeout after which it counts as silent, and no more
  /// seldom than every 10 ms.
  [[nodiscard]] static Duration period(Duration timeout) noexcept {
    using std::chrono::milliseconds;
    constexpr int kPairs = 10;
    return std::clamp<Duration>(timeout / kPairs, milliseconds(1), milliseconds(10));
  }
  /// A clock that cannot be read is tried again after this time.
  static constexpr Duration kAgain = std::chrono::seconds(1);

 private:
  class Source final : public ReferenceSource {
   public:
    void publish(const ReferencePair& pair) noexcept {
      newest_.write({.outcome = Outcome::pair, .pair = pair, .updates = ++updates_});
    }
    [[nodiscard]] Reading read() noexcept override {
      constexpr int kAttempts = 3;
      return newest_.read(kAttempts).value_or(Reading{});
    }

   private:
    Seqlock<Reading> newest_;
    std::uint64_t updates_ = 0;
  };

  void attach();
  // The soft thread.
  void run();
  [[nodiscard]] Result<void> read_clock();
  [[nodiscard]] bool rest(Duration time);
  void note(std::string problem);

  ClockSystem& system_;
  ReferenceName name_;
  Duration period_;
  Source source_;
  bool attached_ = false;
  std::unique_ptr<HostClock> host_clock_;  // the soft thread's; null: not open
  WidthWatch widths_;                      // the same thread's

  std::mutex mutex_;
  std::condition_variable wake_;
  bool ending_ = false;  // guarded by mutex_
  std::string seen_;     // guarded by mutex_: the problem, as the soft thread sees it
  Thread thread_;
};

}  // namespace plchost
