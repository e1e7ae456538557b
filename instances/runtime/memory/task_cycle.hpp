#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "instances/runtime/memory/retain_group.hpp"
#include "instances/runtime/memory/task_areas.hpp"
#include "instances/runtime/variables/force_list.hpp"

namespace plchost {

/// A task's work with its areas and forces around each cycle.
class TaskCycle {
 public:
  void add(InputView& view) { inputs_.push_back(&view); }
  void add(OutputView& view) { outputs_.push_back(&view); }
  /// The task may change retain areas, those of `group`; `may_wait`: it is not real-time.
  void count_into(CycleCounter& counter, RetainGroup& group, bool may_wait) noexcept {
    counter_ = &counter;
    group_ = &group;
    may_wait_ = may_wait;
  }
  /// Applies them before and after the code of the task.
  void use_forces(const ForceSlot& forces) noexcept { forces_ = &forces; }
  /// Where it has area number `area`.
  void set_address(std::size_t area, void* address);
  [[nodiscard]] void* address(std::size_t area) const noexcept {
    return area < addresses_.size() ? addresses_[area] : nullptr;
  }
  /// The one whose run() the calling thread is in; null: none. Any context.
  [[nodiscard]] static const TaskCycle* here() noexcept;
  /// It has nothing to do.
  [[nodiscard]] bool empty() const noexcept {
    return inputs_.empty() && outputs_.empty() && counter_ == nullptr && forces_ == nullptr;
  }

  // The four parts of a cycle, all real-time on the task's thread. An exception of `entry` passes through
  // run(), and then end() is not called: no output is written.
  void begin() noexcept;
  void run(const std::function<void()>& entry) const;
  /// Within run().
  void apply_forces() const noexcept {
    if (forces_ != nullptr) forces_->apply();
  }
  void end() noexcept;
  /// After the cycle: gives the thread that saves retain variables a copy of them. false: nobody has asked
  /// for one.
  bool give_retain() noexcept { return group_ != nullptr && group_->answer(may_wait_); }

 private:
  std::vector<InputView*> inputs_;
  std::vector<OutputView*> outputs_;
  std::vector<void*> addresses_;  // by area
  CycleCounter* counter_ = nullptr;
  RetainGroup* group_ = nullptr;  // with counter_
  bool may_wait_ = false;
  const ForceSlot* forces_ = nullptr;  // null: nothing is ever forced
};

}  // namespace plchost
