#pragma once

#include "schedulers/clock/clock.hpp"

namespace plchost::models {

/// The schedulers' clock: time stands still, sleeps are the checker's.
class ModelClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const noexcept override { return TimePoint(std::chrono::seconds(1000)); }
  [[nodiscard]] Duration thread_time() const noexcept override { return Duration::zero(); }
  void wait(const std::atomic<std::uint32_t>& word, std::uint32_t expected,
            TimePoint deadline) noexcept override {
    futex_wait(&word, expected, deadline);
  }
  void wake(const std::atomic<std::uint32_t>& word) noexcept override { futex_wake(&word); }
  void wait(CountedEvent& event, CountedEvent::Snapshot seen) noexcept override { event.wait(seen); }
  void spin_until(TimePoint /*deadline*/) noexcept override {}
  [[nodiscard]] Result<std::unique_ptr<PeriodicTimer>> make_periodic_timer() override {
    return std::unexpected(Error{});
  }
};

}  // namespace plchost::models
