#include "schedulers/tick/ticker.hpp"

#include <algorithm>
#include <utility>

#include "schedulers/clock_thread.hpp"
#include "shm/base/futex.hpp"

namespace plchost {

Ticker::Ticker(const SchedulerContext& context, std::string thread_name, EventPoller& poller, OnTick on_tick)
    : context_(context),
      clock_(context.clock),
      period_(context.settings.scheduler_interval),
      thread_name_(std::move(thread_name)),
      poller_(poller),
      on_tick_(std::move(on_tick)) {}

Result<void> Ticker::prepare() {
  auto source = make_tick_source(context_);
  if (!source) return failure_in("tick source", std::move(source.error()));
  source_ = std::move(*source);
  auto thread = start_clock_thread(clock_, thread_name_, context_.tick, [this] { run(); });
  if (!thread) return std::unexpected(std::move(thread.error()));
  thread_ = std::move(*thread);
  return {};
}

TimePoint Ticker::first_tick(TimePoint origin) const noexcept {
  const Duration since = std::max(clock_.now() - origin, Duration::zero());
  return origin + (since + period_ - Duration(1)) / period_ * period_;
}

void Ticker::start(TimePoint first) noexcept {
  first_ = first;
  tick_.open(clock_);
}

bool Ticker::prime() noexcept {
  go_.open(clock_);
  constexpr Duration kLook = std::chrono::milliseconds(10);
  const TimePoint deadline = MonotonicClock::now() + kVariablePatience;
  while (primed_.load(std::memory_order_acquire) == 0 && !poller_.parked()) {
    const TimePoint now = MonotonicClock::now();
    if (now >= deadline) return false;
    futex_wait(&primed_, 0, std::min(deadline, now + kLook));
  }
  return true;
}

bool Ticker::stop(TimePoint deadline) noexcept {
  if (!thread_.joinable()) return true;
  if (!stopping_.exchange(true, std::memory_order_acq_rel)) {
    go_.interrupt(clock_);
    tick_.interrupt(clock_);
    source_->interrupt();
  }
  return thread_.join_until(deadline, [this] { return poller_.parked(); });
}

void Ticker::run() noexcept {
  if (go_.wait(clock_) != ActivationGate::Outcome::opened) return;
  poller_.prime(clock_.now());
  primed_.store(1, std::memory_order_release);
  futex_wake(&primed_);
  if (tick_.wait(clock_) != ActivationGate::Outcome::opened) return;
  source_->start(first_, period_);
  while (!stopping_.load(std::memory_order_acquire)) {
    if (const auto tick = source_->wait()) on_tick_(*tick);
  }
}

}  // namespace plchost
