#pragma once

#include <functional>
#include <source_location>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "instances/plc_app.h"
#include "instances/runtime/application/application_declaration.hpp"
#include "instances/runtime/application/message_queue.hpp"
#include "instances/runtime/blocks/block_service.hpp"
#include "instances/runtime/debug/debug_service.hpp"
#include "instances/runtime/memory/areas.hpp"
#include "instances/runtime/settings/settings.hpp"
#include "instances/runtime/tasks/event_table.hpp"
#include "instances/runtime/tasks/task_table.hpp"
#include "instances/runtime/variables/variable_service.hpp"
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

  /// The same, if the caller is on the control thread, where all that is not real-time belongs. Else null,
  /// and the log names `caller`.
  [[nodiscard]] static ApplicationHost* current_for_control(
      const std::source_location& caller = std::source_location::current()) noexcept;

  /// The answer of plc_instance_name(). Any context.
  [[nodiscard]] const std::string& instance() const noexcept { return instance_; }
  /// The answer of plc_parameter(): null if it is not set. Any context.
  [[nodiscard]] const char* parameter(std::string_view name) const noexcept;
  /// Before anything of an application or component runs.
  void set_parameters(Parameters parameters) { parameters_ = std::move(parameters); }

  [[nodiscard]] EventTable& events() noexcept { return events_; }
  [[nodiscard]] BlockService& blocks() noexcept { return blocks_; }
  /// The answer of plc_start_kind(). Set before the application is loaded.
  [[nodiscard]] int start_kind() const noexcept { return start_kind_; }
  void set_start_kind(int kind) noexcept { start_kind_ = kind; }
  [[nodiscard]] MessageQueue& messages() noexcept { return messages_; }
  [[nodiscard]] TaskTable& task_table() noexcept { return task_table_; }
  [[nodiscard]] Areas& areas() noexcept { return areas_; }
  [[nodiscard]] const Areas& areas() const noexcept { return areas_; }
  [[nodiscard]] VariableService& variables() noexcept { return variables_; }
  [[nodiscard]] DebugService& debug() noexcept { return debug_; }
  [[nodiscard]] const DebugService& debug() const noexcept { return debug_; }

  /// The declaration of the running application.
  [[nodiscard]] const ApplicationDeclaration& declaration() const noexcept { return declaration_; }
  /// An application is committed: another one can only take over from it.
  [[nodiscard]] bool has_application() const noexcept { return has_application_; }

  /// Code of components runs while it exists, on the control thread. Its registrations stay, whatever
  /// application runs.
  class ComponentCode {
   public:
    explicit ComponentCode(ApplicationHost& host, bool runs = true) noexcept
        : host_(host), before_(std::exchange(host.in_component_, runs)) {}
    ~ComponentCode() { host_.in_component_ = before_; }
    ComponentCode(const ComponentCode&) = delete;
    ComponentCode& operator=(const ComponentCode&) = delete;

   private:
    ApplicationHost& host_;
    bool before_;
  };

  /// A program is refused after its plc_app_init has returned 0, and no other one runs: `exit` calls its
  /// plc_app_exit, which end_refused() does when the reason was reported.
  void refuse(std::function<void()> exit) { refused_ = std::move(exit); }
  void end_refused();

  /// From here to end_init() a plc_app_init runs. Its calls are collected in `declaration`, and change
  /// nothing else: new events and channels have handles now, which end_version() takes back.
  void begin_init(ApplicationDeclaration& declaration) noexcept;
  void end_init() noexcept;
  /// The caller is in a plc_app_init. Any context.
  [[nodiscard]] bool in_init() const noexcept;
  /// The answer of plc_online_change().
  [[nodiscard]] bool online_change() const noexcept { return online_; }
  void set_online_change(bool online) noexcept;
  /// A version beside the application that runs is gone. The events and channels that only versions without a
  /// commit have opened are free again, and their handles are none any more.
  void end_version() noexcept;

  /// The part of a commit that can fail, and that release() takes back: registers the events of `declaration`
  /// that the application before has not registered; all, or none.
  [[nodiscard]] Result<void> reserve(const ApplicationDeclaration& declaration);
  void release(const ApplicationDeclaration& declaration);
  /// The reserved `declaration` holds from now on. Callbacks of the application before, and others in its
  /// code as `is_code` says, are forgotten. Its events stay registered until end_takeover(), so that no post
  /// is lost that the callbacks of the new one register, too.
  void commit(ApplicationDeclaration declaration, const std::function<bool(const void*)>& is_code);

  /// Unregisters the events of the application before that the one that runs has not registered.
  void end_takeover();

  void set_up_tasks(sys_setup_tasks_struct* tasks) noexcept;
  [[nodiscard]] RTS_RESULT set_task_options(const char* task, const Task_Options* options);
  [[nodiscard]] RTS_RESULT prefer_scheduler(const char* name);
  [[nodiscard]] RTS_RESULT keep_variables(const std::string& name, const CarriedVariables& variables);
  [[nodiscard]] RTS_HANDLE declare_area(const Plc_Area* area, RTS_RESULT& result);
  [[nodiscard]] RTS_RESULT declare_variable(const Plc_Variable* variable);
  [[nodiscard]] RTS_RESULT declare_pou(Plc_Pou* pou);
  [[nodiscard]] RTS_RESULT declare_pou_instance(const Plc_Pou* pou, const void* self, const char* path);
  [[nodiscard]] RTS_RESULT register_event(RTS_HANDLE event);
  [[nodiscard]] RTS_RESULT unregister_event(RTS_HANDLE event);
  [[nodiscard]] RTS_RESULT add_callback(unsigned event, PF_EVENT_CALLBACK callback, void* user);
  [[nodiscard]] RTS_RESULT remove_callback(unsigned event, PF_EVENT_CALLBACK callback, void* user);
  /// Calls the callbacks of `event` for one task.
  void notify(unsigned event, const EVTPARAM_ExternalEventTask& parameter);

  /// Writes what plc_log has queued into the log. Control thread.
  void write_messages();

 private:
  struct Callback {
    EventCallback callback;
    bool of_component;  // else the application's
  };
  [[nodiscard]] bool is_of_running(RTS_HANDLE event) const noexcept;

  std::string instance_;
  Parameters parameters_;
  std::thread::id control_thread_ = std::this_thread::get_id();
  EventTable events_;
  BlockService blocks_;
  MessageQueue messages_;
  TaskTable task_table_;
  VariableService variables_;  // the cycles of areas_ use its forces
  DebugService debug_;
  Areas areas_;
  int start_kind_ = PLC_START_FIRST;
  ApplicationDeclaration declaration_;
  bool has_application_ = false;
  ApplicationDeclaration* collected_ = nullptr;  // while a plc_app_init runs
  bool online_ = false;
  bool in_component_ = false;
  std::vector<RTS_HANDLE> late_events_;     // registered by the application outside of its plc_app_init
  std::vector<RTS_HANDLE> leaving_events_;  // of the one before, from commit() to end_takeover()
  std::vector<Callback> callbacks_;
  std::function<void()> refused_;  // empty: no program was refused
};

}  // namespace plchost
