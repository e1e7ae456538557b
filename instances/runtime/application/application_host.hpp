#pragma once

#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "instances/plc_app.h"
#include "instances/runtime/application/application_declaration.hpp"
#include "instances/runtime/application/message_queue.hpp"
#include "instances/runtime/blocks/block_service.hpp"
#include "instances/runtime/memory/areas.hpp"
#include "instances/runtime/tasks/event_table.hpp"
#include "instances/runtime/tasks/task_table.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// The implementation of the functions that plc_app.h declares. Those have no argument that says which
/// runtime is meant: so there is one of these in a process, and it is found by current().
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

  /// The declaration of the running application.
  [[nodiscard]] const ApplicationDeclaration& declaration() const noexcept { return declaration_; }

  /// From here to end_init() a plc_app_init runs. `online`: of a program that is to take over from the one
  /// that runs: its calls are collected there, and change nothing else.
  void begin_init(ApplicationDeclaration* online = nullptr) noexcept;
  void end_init() noexcept;
  /// The caller is in the plc_app_init of a program that is to take over. Any context.
  [[nodiscard]] bool in_online_init() const noexcept;
  /// The answer of plc_online_change().
  [[nodiscard]] bool online_change() const noexcept { return online_; }
  void set_online_change(bool online) noexcept { online_ = online; }
  /// The declaration of `online` holds from now on. Callbacks of the program before, and others in its code
  /// as `is_code` says, are forgotten.
  void take_over(ApplicationDeclaration online, const std::function<bool(const void*)>& is_code);
  /// Registers the events of `online` that the program before has not registered; all, or none.
  [[nodiscard]] Result<void> register_more(const ApplicationDeclaration& online);
  void unregister_more(const ApplicationDeclaration& online);

  void set_up_tasks(sys_setup_tasks_struct* tasks) noexcept;
  [[nodiscard]] RTS_RESULT set_task_options(const char* task, const Task_Options* options);
  [[nodiscard]] RTS_RESULT keep_variables(const KeptVariables& variables);
  [[nodiscard]] RTS_HANDLE declare_area(const Plc_Area* area, RTS_RESULT& result);
  [[nodiscard]] RTS_RESULT register_event(RTS_HANDLE event);
  [[nodiscard]] RTS_RESULT unregister_event(RTS_HANDLE event);
  [[nodiscard]] RTS_RESULT add_callback(unsigned event, PF_EVENT_CALLBACK callback, void* user);
  [[nodiscard]] RTS_RESULT remove_callback(unsigned event, PF_EVENT_CALLBACK callback, void* user);
  /// Calls the callbacks of `event` for one task.
  void notify(unsigned event, const EVTPARAM_ExternalEventTask& parameter) const;

  /// Writes what plc_log has queued into the log. Control thread.
  void write_messages();

 private:
  struct Callback {
    EventCallback callback;
    bool of_init;  // registered by the application in its plc_app_init
  };

  std::thread::id control_thread_ = std::this_thread::get_id();
  EventTable events_;
  BlockService blocks_;
  MessageQueue messages_;
  TaskTable task_table_;
  Areas areas_;
  int start_kind_ = PLC_START_FIRST;
  ApplicationDeclaration declaration_;
  bool in_init_ = false;
  ApplicationDeclaration* online_declaration_ = nullptr;  // while its plc_app_init runs
  bool online_ = false;
  std::vector<Callback> callbacks_;
};

}  // namespace plchost
