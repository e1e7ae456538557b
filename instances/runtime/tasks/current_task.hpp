#pragma once

#include "instances/plc_app.h"

namespace plchost {

/// Says on this thread whose cycle it runs, as long as it exists: for plc_current_task(). Real-time.
class CurrentTask {
 public:
  explicit CurrentTask(Task_Info* task) noexcept;
  ~CurrentTask();
  CurrentTask(const CurrentTask&) = delete;
  CurrentTask& operator=(const CurrentTask&) = delete;
};

/// The task whose code this thread runs; null: none. Any context.
[[nodiscard]] Task_Info* current_task() noexcept;

}  // namespace plchost
