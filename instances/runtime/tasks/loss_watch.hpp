#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "instances/runtime/tasks/core_record.hpp"
#include "schedulers/faults/processor_times.hpp"
#include "schedulers/task_set.hpp"
#include "shm/pages/flight_page.hpp"

namespace plchost {

/// Finds the cause of each loss of cycles, and keeps it in the flight recorder's page. It runs on the control
/// thread within 100 ms of its entry. The entries are still there then. Only this process can ask how much
/// processor time its threads have used. The cycle itself pays nothing for it.
///
/// A cycle that took too long may have computed, or have stood still because the machine stopped, another
/// process took the core, or the process was stopped. The record says how long a task had the core, the
/// kernel how much of that it got.
class LossWatch {
 public:
  /// More losses between two looks are counted by their tasks, but not told.
  static constexpr std::size_t kMostAtOnce = 8;
  /// The processor time of more tasks is not asked: a look costs a system call for each.
  static constexpr std::size_t kMostAsked = 64;

  /// All outlive it. Set-up.
  LossWatch(FlightPage& page, TaskSet& tasks, bool one_core,
            const ProcessorTimes& times = linux_processor_times());

  /// Every 100 ms. Control thread.
  void look(TimePoint now);

 private:
  struct OfTask {
    TimePoint fault;         // that has stopped it; 0: none
    std::uint64_t lost = 0;  // Task::pace() at the last look
    std::uint64_t next = 0;  // the first entry that was not looked at for losses
    Duration used{};         // processor time at the last look
    Duration used_now{};     // and now
    Duration per_cycle{};    // of it, a cycle costs outside of what the record shows
    Duration unexplained{};  // at this look: had the core by the record, but not by the kernel
  };
  struct Found {
    std::size_t task;
    CoreRecord::Loss loss;
  };

  [[nodiscard]] bool ask_tasks();
  [[nodiscard]] TimePoint fault_of(std::size_t task);
  [[nodiscard]] CoreRecord read(TimePoint now, bool all);
  [[nodiscard]] std::vector<Found> find_new(const CoreRecord& record) const;
  void compare_times(const CoreRecord& record, TimePoint now, bool calibrates);
  void tell(const CoreRecord& record, const Found& found);
  void remember(TimePoint now);

  FlightPage& page_;
  TaskSet& tasks_;
  bool one_core_;
  const ProcessorTimes& times_;
  std::vector<OfTask> of_task_;
  std::vector<std::uint64_t> from_;   // of each ring: where reading begins, 1 to 2 s back
  std::vector<std::uint64_t> later_;  // where it will begin
  TimePoint moved_;                   // when later_ was taken
  TimePoint looked_at_;
  unsigned looks_ = 0;
};

}  // namespace plchost
