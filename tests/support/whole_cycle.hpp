#pragma once

#include "schedulers/tasks/task_config.hpp"

namespace plchost {

/// One cycle with all that belongs to it, as Task runs it.
inline void run_whole_cycle(const TaskConfig& task) {
  if (task.before_entry) task.before_entry();
  task.entry();
  if (task.after_entry) task.after_entry();
  if (task.between_cycles) (void)task.between_cycles();
}

}  // namespace plchost
