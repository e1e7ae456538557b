#include "instances/runtime/memory/task_cycle.hpp"

namespace plchost {

namespace {

thread_local const TaskCycle* cycle_here = nullptr;

// Says on this thread whose cycle it runs: also if that ends with an exception.
class CycleHere {
 public:
  explicit CycleHere(const TaskCycle* cycle) noexcept { cycle_here = cycle; }
  ~CycleHere() { cycle_here = nullptr; }
  CycleHere(const CycleHere&) = delete;
  CycleHere& operator=(const CycleHere&) = delete;
};

}  // namespace

const TaskCycle* TaskCycle::here() noexcept {
  return cycle_here;
}

void TaskCycle::set_address(std::size_t area, void* address) {
  if (addresses_.size() <= area) addresses_.resize(area + 1, nullptr);
  addresses_[area] = address;
}

void TaskCycle::begin() noexcept {
  if (counter_ != nullptr) {
    counter_->store(counter_->load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    // Pairs with the acquire fence of RetainMemory::snapshot().
    std::atomic_thread_fence(std::memory_order_release);
  }
  for (InputView* const view : inputs_) view->begin_cycle();
  for (OutputView* const view : outputs_) view->begin_cycle();
}

void TaskCycle::run(const std::function<void()>& entry) const {
  const CycleHere here(this);
  apply_forces();
  entry();
  apply_forces();
}

void TaskCycle::end() noexcept {
  for (OutputView* const view : outputs_) view->end_cycle();
  if (counter_ != nullptr) {
    counter_->store(counter_->load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }
}

}  // namespace plchost
