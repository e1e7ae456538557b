#include "instances/runtime/application/application_host.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include "shm/base/log.hpp"

namespace plchost {

namespace {

ApplicationHost* the_host = nullptr;  // set before anything of an application runs, cleared after
thread_local Task_Info* task_here = nullptr;

}  // namespace

ApplicationHost::ApplicationHost(const std::string& instance, ObjectPool* pool)
    : events_(instance, pool), blocks_(pool == nullptr ? "" : pool->name(), instance) {
  the_host = this;
}

ApplicationHost::~ApplicationHost() {
  the_host = nullptr;
}

ApplicationHost* ApplicationHost::current() noexcept {
  return the_host;
}

ApplicationHost* ApplicationHost::current_for_control() noexcept {
  if (the_host == nullptr || std::this_thread::get_id() == the_host->control_thread_) return the_host;
  the_host->messages_.push(PLC_LOG_ERROR,
                           "a function of plc_app.h for the control thread was called elsewhere");
  return nullptr;
}

void ApplicationHost::set_up_tasks(sys_setup_tasks_struct* tasks) noexcept {
  given_twice_ = given_twice_ || tasks_ != nullptr;
  tasks_ = tasks;
  task_table_.set_up(tasks);
}

RTS_RESULT ApplicationHost::set_task_options(const char* task, const Task_Options* options) {
  auto settings = from_options(task, options);
  if (!settings) {
    spdlog::error("plc_set_task_options: {}", settings.error().describe());
    return ERR_PARAMETER;
  }
  if (std::ranges::find(task_options_, settings->task, &TaskSettings::task) != task_options_.end()) {
    return ERR_DUPLICATE;
  }
  task_options_.push_back(*std::move(settings));
  return ERR_OK;
}

RTS_RESULT ApplicationHost::add_callback(unsigned event, PF_EVENT_CALLBACK callback, void* user) {
  const bool known = event == EVT_ExternalEventTaskCreateDone || event == EVT_PrepareExternalEventTaskDelete;
  if (!known || callback == nullptr) return ERR_PARAMETER;
  const Callback wanted{event, callback, user};
  if (std::ranges::find(callbacks_, wanted) != callbacks_.end()) return ERR_DUPLICATE;
  if (callbacks_.size() == PLC_MAX_EVENT_CALLBACKS) return ERR_NOMEMORY;
  callbacks_.push_back(wanted);
  return ERR_OK;
}

RTS_RESULT ApplicationHost::remove_callback(unsigned event, PF_EVENT_CALLBACK callback, void* user) {
  return std::erase(callbacks_, Callback{event, callback, user}) == 0 ? ERR_NO_OBJECT : ERR_OK;
}

void ApplicationHost::notify(unsigned event, const EVTPARAM_ExternalEventTask& parameter) const {
  const auto now = callbacks_;  // a callback may register or unregister
  for (const Callback& callback : now) {
    if (callback.event != event) continue;
    try {
      callback.function(event, &parameter, callback.user);
    } catch (const std::exception& error) {
      spdlog::error("a callback of event {:#x} threw: {}", event, error.what());
    } catch (...) {
      spdlog::error("a callback of event {:#x} threw an exception", event);
    }
  }
}

void ApplicationHost::write_messages() {
  messages_.drain([](int level, std::string_view text) {
    const auto severity = level == PLC_LOG_INFO      ? spdlog::level::info
                          : level == PLC_LOG_WARNING ? spdlog::level::warn
                                                     : spdlog::level::err;
    spdlog::log(severity, "application: {}", text);
  });
  if (const auto dropped = messages_.take_dropped(); dropped > 0) {
    spdlog::warn("application: {} more messages were dropped, it logs faster than {} per 100 ms", dropped,
                 MessageQueue::kCapacity);
  }
}

CurrentTask::CurrentTask(Task_Info* task) noexcept {
  task_here = task;
}
CurrentTask::~CurrentTask() {
  task_here = nullptr;
}

}  // namespace plchost

// What applications and components call: see plc_app.h. exported_symbols.txt lists them for the linker.

using plchost::ApplicationHost;

void __sys__setup__tasks(sys_setup_tasks_struct* p) {
  if (ApplicationHost* const host = ApplicationHost::current_for_control()) host->set_up_tasks(p);
}

RTS_RESULT plc_set_task_options(const char* pszTask, const Task_Options* pOptions) {
  ApplicationHost* const host = ApplicationHost::current_for_control();
  return host == nullptr ? ERR_NOTINITIALIZED : host->set_task_options(pszTask, pOptions);
}

Task_Info* plc_current_task() {
  return plchost::task_here;
}

RTS_HANDLE SchedRegisterExternalEvent(const char* pszEvent, RTS_RESULT* pResult) {
  const auto finish = [&](RTS_RESULT result, RTS_HANDLE handle) {
    if (pResult != nullptr) *pResult = result;
    return handle;
  };
  ApplicationHost* const host = ApplicationHost::current_for_control();
  if (host == nullptr) return finish(ERR_NOTINITIALIZED, RTS_INVALID_HANDLE);
  if (pszEvent == nullptr) return finish(ERR_PARAMETER, RTS_INVALID_HANDLE);
  const auto handle = host->events().open(pszEvent);
  if (!handle) {
    spdlog::error("SchedRegisterExternalEvent: {}", handle.error().describe());
    const bool name = handle.error().code == plchost::ErrorCode::invalid_argument;
    return finish(name ? ERR_PARAMETER : ERR_NOMEMORY, RTS_INVALID_HANDLE);
  }
  const auto registered = host->events().register_by_application(*handle);
  if (registered) return finish(ERR_OK, *handle);
  if (registered.error().code == plchost::ErrorCode::already_exists) return finish(ERR_DUPLICATE, *handle);
  spdlog::error("SchedRegisterExternalEvent: {}", registered.error().describe());
  return finish(ERR_NOMEMORY, RTS_INVALID_HANDLE);
}

RTS_RESULT SchedUnregisterExternalEvent(RTS_HANDLE hEvent) {
  ApplicationHost* const host = ApplicationHost::current_for_control();
  if (host == nullptr) return ERR_NOTINITIALIZED;
  const auto done = host->events().unregister_by_application(hEvent);
  if (done) return ERR_OK;
  return done.error().code == plchost::ErrorCode::not_found ? ERR_NO_OBJECT : ERR_PARAMETER;
}

RTS_RESULT SchedPostExternalEvent(RTS_HANDLE hEvent) {
  ApplicationHost* const host = ApplicationHost::current();
  return host == nullptr ? ERR_NOTINITIALIZED : host->events().post(hEvent);
}

RTS_RESULT EventRegisterCallbackFunction(unsigned int EventId, PF_EVENT_CALLBACK pfCallback, void* pUser) {
  ApplicationHost* const host = ApplicationHost::current_for_control();
  return host == nullptr ? ERR_NOTINITIALIZED : host->add_callback(EventId, pfCallback, pUser);
}

RTS_RESULT EventUnregisterCallbackFunction(unsigned int EventId, PF_EVENT_CALLBACK pfCallback, void* pUser) {
  ApplicationHost* const host = ApplicationHost::current_for_control();
  return host == nullptr ? ERR_NOTINITIALIZED : host->remove_callback(EventId, pfCallback, pUser);
}

RTS_RESULT CAL_SysEventSet(RTS_HANDLE hEvent) {
  ApplicationHost* const host = ApplicationHost::current();
  return host == nullptr ? ERR_NOTINITIALIZED : host->events().set(hEvent);
}

int plc_start_kind() {
  const ApplicationHost* const host = ApplicationHost::current();
  return host == nullptr ? PLC_START_FIRST : host->start_kind();
}

void plc_log(int nLevel, const char* pszText) {
  ApplicationHost* const host = ApplicationHost::current();
  if (host != nullptr && pszText != nullptr) host->messages().push(nLevel, pszText);
}
