#include "instances/runtime/debug/debug_task.hpp"

#include <algorithm>
#include <utility>

#include <unistd.h>

#include "shm/base/futex.hpp"

namespace plchost {

void DebugTask::statement(Plc_Frame& frame, const void* marker, std::uint64_t cycle) noexcept {
  if (FaultTrap::here() != &task_.trap()) return;  // an event variable is read
  if (ignored() || board_.suspended.load(std::memory_order_acquire)) return;
  const std::uint32_t breakpoint = look_at_breakpoints(frame);
  const auto stop = [&](HaltReason reason) {
    stop_here({.frame = &frame,
               .marker = marker,
               .cycle = cycle,
               .reason = reason,
               .breakpoint = breakpoint,
               .number = halts() + 1});
  };
  if (breakpoint != 0) return stop(HaltReason::breakpoint);
  if (pause_.load(std::memory_order_relaxed)) return stop(HaltReason::pause);
  if (steps() && step_.halts_at(frame, marker, cycle)) return stop(HaltReason::step);
}

// The id of the first that halts here; 0: none.
std::uint32_t DebugTask::look_at_breakpoints(const Plc_Frame& frame) noexcept {
  std::uint32_t halts_at = 0;
  if (const BreakpointTable* const table = table_.take(board_.table)) {
    for (const auto& breakpoint : table->at(frame.pPou->dwNumber, frame.dwLine)) {
      if (breakpoint->condition && !breakpoint->condition->holds(frame)) continue;
      const std::uint64_t hit = breakpoint->hits->fetch_add(1, std::memory_order_relaxed) + 1;
      if (!breakpoint->hit_rule.holds(hit)) continue;
      if (breakpoint->log) {
        note(*breakpoint, frame);
      } else if (halts_at == 0) {
        halts_at = breakpoint->id;
      }
    }
  }
  table_.let_go();
  return halts_at;
}

void DebugTask::note(const Breakpoint& breakpoint, const Plc_Frame& frame) noexcept {
  const std::uint64_t number = logged_.load(std::memory_order_relaxed);
  if (number - taken_.load(std::memory_order_acquire) == kLogHits) {
    lost_logs_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  LogHit& hit = logs_[number % kLogHits];
  hit.breakpoint = breakpoint.id;
  const auto& values = breakpoint.log->values;
  for (std::size_t i = 0; i < values.size(); ++i)
    std::ranges::copy(values[i].read(frame), hit.values[i].begin());
  logged_.store(number + 1, std::memory_order_release);
}

void DebugTask::take_logs(const std::function<void(const LogHit&)>& with) {
  const std::uint64_t end = logged_.load(std::memory_order_acquire);
  for (std::uint64_t number = taken_.load(std::memory_order_relaxed); number != end; ++number) {
    with(logs_[number % kLogHits]);
    taken_.store(number + 1, std::memory_order_release);
  }
}

void DebugTask::stop_here(const Halt& halt) noexcept {
  const TimePoint from = MonotonicClock::now();
  if (std::exchange(halted_cycle_, halt.cycle) != halt.cycle) halted_in_cycle_ = {};
  halt_ = halt;
  halt_.since = from;
  halt_.before = halted_in_cycle_;
  halts_.store(halt.number, std::memory_order_relaxed);
  (void)forget_steps();
  const std::uint32_t gate = gate_.load(std::memory_order_relaxed);
  task_.stand_still([this, gate] {
    if (board_.suspended.load(std::memory_order_acquire)) return;
    halted_.store(std::uint64_t{gate} + 1, std::memory_order_release);
    const std::uint64_t one = 1;
    (void)!::write(board_.notify, &one, sizeof one);  // fails only if it is readable already
    const auto is_held = [&] {
      return gate_.load(std::memory_order_acquire) == gate &&
             !board_.suspended.load(std::memory_order_acquire);
    };
    while (is_held()) futex_wait(&gate_, gate);
    halted_.store(0, std::memory_order_relaxed);
  });
  const Duration halted = MonotonicClock::now() - from;
  halted_in_cycle_ += halted;
  halted_ns_.fetch_add(halted.count(), std::memory_order_relaxed);
}

std::optional<DebugTask::Halt> DebugTask::halt() const noexcept {
  // One that was roused may not have left its halt yet: only the control thread turns the gate.
  const std::uint64_t gate = gate_.load(std::memory_order_relaxed);
  if (halted_.load(std::memory_order_acquire) != gate + 1 || board_.suspended.load(std::memory_order_relaxed))
    return std::nullopt;
  return halt_;
}

void DebugTask::let_go(const StepRule& step) noexcept {
  step_ = step;
  pause_.store(false, std::memory_order_relaxed);
  stepping_.store(step.kind != StepRule::Kind::none, std::memory_order_relaxed);
  halted_.store(0, std::memory_order_relaxed);
}

void DebugTask::rouse() noexcept {
  gate_.fetch_add(1, std::memory_order_release);
  futex_wake(&gate_);
}

}  // namespace plchost
