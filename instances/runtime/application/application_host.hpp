#pragma once

#include <string>
#include <thread>
#include <vector>

#include "instances/plc_app.h"
#include "instances/runtime/areas/areas.hpp"
#include "instances/runtime/blocks/block_service.hpp"
#include "instances/runtime/message_queue.hpp"
#include "instances/runtime/settings/task_settings.hpp"
#include "instances/runtime/tasks/event_table.hpp"
#include "instances/runtime/tasks/task_table.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// What stands behind the functions that plc_app.h declares. Those have no argument that says which runtime
/// is meant: so there is one of these in a process, and it is found by current().
class ApplicationHost {
 public:
  ApplicationHost(const std::string& instance, ObjectPool* pool);
  ~ApplicationHost();
  ApplicationHost(const ApplicationHost&) = delete;
  ApplicationHost& operator=(const ApplicationHost&) = delete;

  /// The one of this process; null if there is none.
  [[nodiscard]] static ApplicationHost* current() noexcept;

  /// The same, if the caller is on the control thread, where all that is not real-time belongs; else null.
  [[nodiscard]] static ApplicationHost* current_for_control() noexcept;

  [[nodiscard]] EventTable& events() noexcept { return events_; }
  [[nodiscard]] BlockService& blocks() noexcept { return blocks_; }
  /// The answer of plc_start_kind(). Set before the application is loaded.
  [[nodiscard]] int start_kind() const noexcept { return start_kind_; }
  void set_start_kind(int kind) noexcept { start_kind_ = kind; }
  [[nodiscard]] MessageQueue& messages() noexcept { return messages_; }
  [[nodiscard]] TaskTable& task_table() noexcept { return task_table_; }
  [[nodiscard]] Areas& areas() noexcept { return areas_; }
  [[nodiscard]] const Areas& areas() const noexcept { return areas_; }

  /// What the application handed over; null if nothing yet.
  [[nodiscard]] sys_setup_tasks_struct* tasks() const noexcept { return tasks_; }
  [[nodiscard]] bool tasks_given_twice() const noexcept { return given_twice_; }

  /// What the application said with plc_set_task_options().
  [[nodiscard]] const std::vector<TaskSettings>& task_options() const noexcept { return task_options_; }

  void set_up_tasks(sys_setup_tasks_struct* tasks) noexcept;
  [[nodiscard]] RTS_RESULT set_task_options(const char* task, const Task_Options* options);
  [[nodiscard]] RTS_RESULT add_callback(unsigned event, PF_EVENT_CALLBACK callback, void* user);
  [[nodiscard]] RTS_RESULT remove_callback(unsigned event, PF_EVENT_CALLBACK callback, void* user);
  /// Calls the callbacks of `event` for one task.
  void notify(unsigned event, const EVTPARAM_ExternalEventTask& parameter) const;

  /// Writes what plc_log has queued into the log. Control thread.
  void write_messages();

 private:
  struct Callback {
    unsigned event;
    PF_EVENT_CALLBACK function;
    void* user;
    bool operator==(const Callback&) const = default;
  };

  std::thread::id control_thread_ = std::this_thread::get_id();
  EventTable events_;
  BlockService blocks_;
  MessageQueue messages_;
  TaskTable task_table_;
  Areas areas_;
  sys_setup_tasks_struct* tasks_ = nullptr;
  bool given_twice_ = false;
  int start_kind_ = PLC_START_FIRST;
  std::vector<TaskSettings> task_options_;
  std::vector<Callback> callbacks_;
};

/// Says on this thread whose cycle it runs, as long as it lives: for plc_current_task(). Real-time.
class CurrentTask {
 public:
  explicit CurrentTask(Task_Info* task) noexcept;
  ~CurrentTask();
  CurrentTask(const CurrentTask&) = delete;
  CurrentTask& operator=(const CurrentTask&) = delete;
};

}  // namespace plchost
