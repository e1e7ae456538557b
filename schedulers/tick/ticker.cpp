#include "schedulers/tick/ticker.hpp"

#include <algorithm>
#include <utility>

#include "schedulers/clock/clock.hpp"
#include "shm/base/futex.hpp"

namespace plchost {

namespace {

constexpr Duration kTickerLook = std::chrono::milliseconds(10);

}  // namespace

Ticker::~Ticker() {
  use(nullptr);
  ending_.store(true);
  order_.fetch_add(1);
  clock_.wake(order_);
  (void)thread_.join_until(kNoDeadline, [this] { return poller_.parked(); });
}

Result<void> Ticker::start_thread(ThreadPriority priority) {
  PLCHOST_TRY_ASSIGN(thread_, start_clock_thread(clock_, "tick", priority, [this] { run(); }));
  return {};
}

void Ticker::use(TickPlan* plan) noexcept {
  TickPlan* const before = wanted_.exchange(plan);
  if (before == nullptr && plan == nullptr) return;  // it rests, or is about to
  order_.fetch_add(1);
  clock_.wake(order_);
  if (before != nullptr && before->source) before->source->interrupt();
}

bool Ticker::settled(TimePoint deadline) noexcept {
  for (;;) {
    const std::uint32_t done = done_.load(std::memory_order_acquire);
    if (done == order_.load() || !thread_.joinable() || poller_.parked()) return true;
    const TimePoint now = MonotonicClock::now();
    if (now >= deadline) return false;
    futex_wait(&done_, done, std::min(deadline, now + kTickerLook));  // a thread that is parked wakes nobody
  }
}

void Ticker::begin(TickPlan* plan) noexcept {
  const std::optional<TimePoint> before = std::exchange(last_tick_, std::nullopt);
  if (plan == nullptr) return;
  poller_.prime(clock_.now());
  if (!plan->source) return;
  poller_.set_max_backlog(plan->max_backlog);
  const Duration period = plan->period;
  const Duration since = std::max(clock_.now() - plan->origin, Duration::zero());
  const TimePoint first = plan->origin + (since + period - Duration(1)) / period * period;
  const TimePoint passed = first - period;
  if (plan->scheduler != nullptr) plan->scheduler->on_tick(passed);
  // It fell due when the plan before was given up, or lies between the grids of the two.
  if (before && *before < passed) poller_.poll(passed);
  last_tick_ = passed;
  plan->source->start(first, period);
}

void Ticker::run() noexcept {
  std::uint32_t obeyed = 0;
  TickPlan* plan = nullptr;
  while (!ending_.load(std::memory_order_acquire)) {
    if (const std::uint32_t order = order_.load(std::memory_order_acquire); order != obeyed) {
      plan = wanted_.load(std::memory_order_acquire);
      begin(plan);
      obeyed = order;
      done_.store(order, std::memory_order_release);
      futex_wake(&done_);
    } else if (plan == nullptr || !plan->source) {
      clock_.wait(order_, obeyed, kNoDeadline);
    } else if (const auto tick = plan->source->wait()) {
      if (plan->scheduler != nullptr) plan->scheduler->on_tick(*tick);
      poller_.poll(*tick);
      last_tick_ = *tick;
    }
  }
}

}  // namespace plchost
