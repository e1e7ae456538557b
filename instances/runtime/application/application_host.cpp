#include "instances/runtime/application/application_host.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdio>
#include <exception>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "instances/runtime/tasks/task_builder.hpp"
#include "schedulers/policies/registry.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

ApplicationHost* the_host = nullptr;  // set before anything of an application runs, cleared after

template <class Range, class Value, class Projection = std::identity>
bool has(const Range& range, const Value& value, Projection projection = {}) {
  return std::ranges::find(range, value, projection) != range.end();
}

}  // namespace

ApplicationHost::ApplicationHost(const std::string& instance, ObjectPool* pool)
    : instance_(instance), events_(instance, pool), blocks_(pool == nullptr ? "" : pool->name(), instance) {
  the_host = this;
}

ApplicationHost::~ApplicationHost() {
  the_host = nullptr;
}

ApplicationHost* ApplicationHost::current() noexcept {
  return the_host;
}

ApplicationHost* ApplicationHost::current_for_control(const std::source_location& caller) noexcept {
  if (the_host == nullptr || std::this_thread::get_id() == the_host->control_thread_) return the_host;
  std::array<char, MessageQueue::kMaxText> text{};
  (void)std::snprintf(text.data(), text.size(), "%s belongs to the control thread: call it from plc_app_init",
                      caller.function_name());
  the_host->messages_.push(PLC_LOG_ERROR, text.data());
  return nullptr;
}

const char* ApplicationHost::parameter(std::string_view name) const noexcept {
  const auto known = parameters_.find(name);
  return known == parameters_.end() ? nullptr : known->second.c_str();
}

void ApplicationHost::end_refused() {
  if (const auto exit = std::exchange(refused_, nullptr)) exit();
}

// As it is in force: declared, or registered later.
bool ApplicationHost::is_of_running(RTS_HANDLE event) const noexcept {
  return has(declaration_.events, event) || has(late_events_, event);
}

void ApplicationHost::begin_init(ApplicationDeclaration& declaration) noexcept {
  collected_ = &declaration;
  set_online_change(has_application_);
}

void ApplicationHost::end_init() noexcept {
  set_online_change(false);
  collected_ = nullptr;
}

void ApplicationHost::set_online_change(bool online) noexcept {
  online_ = online;
  events_.open_for_version(online);
  blocks_.open_for_version(online);
}

void ApplicationHost::end_version() noexcept {
  events_.give_back_opened();
  blocks_.give_back_opened();
}

bool ApplicationHost::in_init() const noexcept {
  return std::this_thread::get_id() == control_thread_ && collected_ != nullptr;
}

Result<void> ApplicationHost::reserve(const ApplicationDeclaration& declaration) {
  for (const RTS_HANDLE event : declaration.events) {
    if (is_of_running(event)) continue;
    if (auto done = events_.register_by_application(event); !done) {
      release(declaration);
      return done;
    }
  }
  return {};
}

void ApplicationHost::release(const ApplicationDeclaration& declaration) {
  for (const RTS_HANDLE event : declaration.events) {
    if (!is_of_running(event)) (void)events_.unregister_by_application(event);
  }
}

void ApplicationHost::commit(ApplicationDeclaration declaration,
                             const std::function<bool(const void*)>& is_code) {
  std::ranges::copy(declaration_.events, std::back_inserter(leaving_events_));
  std::ranges::move(std::exchange(late_events_, {}), std::back_inserter(leaving_events_));
  std::erase_if(leaving_events_, [&](RTS_HANDLE event) { return has(declaration.events, event); });
  std::erase_if(callbacks_, [&](const Callback& known) {
    return !known.of_component || is_code(std::bit_cast<const void*>(known.callback.function));
  });
  for (const EventCallback& callback : declaration.callbacks) {
    callbacks_.push_back({.callback = callback, .of_component = false});
  }
  events_.keep_opened();
  blocks_.keep_opened();
  declaration_ = std::move(declaration);
  has_application_ = true;
}

void ApplicationHost::end_takeover() {
  for (const RTS_HANDLE event : std::exchange(leaving_events_, {})) {
    (void)events_.unregister_by_application(event);
  }
}

void ApplicationHost::set_up_tasks(sys_setup_tasks_struct* tasks) noexcept {
  if (collected_ == nullptr) {
    spdlog::error("__sys__setup__tasks: tasks are handed over in plc_app_init only");
    return;
  }
  collected_->tasks_given_twice = collected_->tasks_given_twice || collected_->tasks != nullptr;
  collected_->tasks = tasks;
  // Handles are there from this call on. Those of another version are those of the tasks that run.
  if (!has_application_) task_table_.set_up(tasks);
}

RTS_RESULT ApplicationHost::prefer_scheduler(const char* name) {
  const auto refuse = [](RTS_RESULT why, std::string_view text) {
    spdlog::error("plc_prefer_scheduler: {}", text);
    return why;
  };
  if (collected_ == nullptr) return refuse(ERR_NOTINITIALIZED, "it is named in plc_app_init only");
  if (name == nullptr) return refuse(ERR_PARAMETER, "pszScheduler is null");
  const std::string wanted(cut(name, PLC_MAX_VARIABLE_NAME));
  if (const auto found = find_scheduler(wanted); !found) return refuse(ERR_PARAMETER, found.error().message);
  if (!collected_->scheduler.empty()) return refuse(ERR_DUPLICATE, "a scheduler is named twice");
  collected_->scheduler = wanted;
  return ERR_OK;
}

RTS_RESULT ApplicationHost::keep_variables(const std::string& name, const CarriedVariables& variables) {
  const auto refuse = [&](RTS_RESULT why, std::string_view text) {
    spdlog::error("plc_keep_variables: variables '{}': {}", shown(name), text);
    return why;
  };
  if (collected_ == nullptr) return refuse(ERR_NOTINITIALIZED, "they are named in plc_app_init only");
  if (auto valid = check_name("variables", name, PLC_MAX_VARIABLE_NAME); !valid)
    return refuse(ERR_PARAMETER, valid.error().message);
  if ((variables.address == nullptr) != (variables.bytes == 0))
    return refuse(ERR_PARAMETER, "either pAddress is null or dwBytes is 0, not both");
  if (collected_->variables.contains(name)) return refuse(ERR_DUPLICATE, "are named twice");
  const std::uint64_t bytes = collected_->variable_bytes + variables.bytes;
  if (collected_->variables.size() == PLC_MAX_VARIABLES || bytes > PLC_MAX_VARIABLE_BYTES) {
    return refuse(ERR_NOMEMORY, fmt::format("at most {} with {} bytes in all can be named", PLC_MAX_VARIABLES,
                                            PLC_MAX_VARIABLE_BYTES));
  }
  collected_->variables.emplace(name, variables);
  collected_->variable_bytes = bytes;
  return ERR_OK;
}

RTS_HANDLE ApplicationHost::declare_area(const Plc_Area* area, RTS_RESULT& result) {
  if (collected_ != nullptr) return areas_.declare(collected_->areas, area, result);
  spdlog::error("plc_declare_area: areas are declared in plc_app_init only");
  result = ERR_NOTINITIALIZED;
  return RTS_INVALID_HANDLE;
}

RTS_RESULT ApplicationHost::declare_variable(const Plc_Variable* variable) {
  if (collected_ != nullptr) return collected_->seen.declare(variable);
  spdlog::error("plc_declare_variable: variables are declared in plc_app_init only");
  return ERR_NOTINITIALIZED;
}

RTS_RESULT ApplicationHost::declare_pou(Plc_Pou* pou) {
  if (collected_ != nullptr) return collected_->pous.declare(pou);
  spdlog::error("plc_debug_declare_pou: POUs are declared in plc_app_init only");
  return ERR_NOTINITIALIZED;
}

RTS_RESULT ApplicationHost::declare_pou_instance(const Plc_Pou* pou, const void* self, const char* path) {
  if (collected_ != nullptr) return collected_->pous.declare_instance(pou, self, path);
  spdlog::error("plc_debug_declare_instance: instances are declared in plc_app_init only");
  return ERR_NOTINITIALIZED;
}

RTS_RESULT ApplicationHost::register_event(RTS_HANDLE event) {
  if (collected_ != nullptr && events_.is_own(event)) {
    // By the application that runs it is no obstacle; by a component it is.
    const bool by_component = events_.is_by_application(event) && !is_of_running(event);
    if (by_component || has(collected_->events, event)) return ERR_DUPLICATE;
    collected_->events.push_back(event);
    return ERR_OK;
  }
  // The plc_app_exit of a version that leaves while another one runs on.
  if (online_ && collected_ == nullptr) {
    spdlog::error("SchedRegisterExternalEvent: a version that leaves cannot register events");
    return ERR_NOTINITIALIZED;
  }
  // An operator may have unregistered it since the version that leaves registered it.
  const bool taken_over = std::erase(leaving_events_, event) != 0 && events_.is_by_application(event);
  const auto registered = taken_over ? Result<void>() : events_.register_by_application(event);
  if (registered) {
    if (events_.is_own(event) && !in_component_) late_events_.push_back(event);
    return ERR_OK;
  }
  if (registered.error().code == ErrorCode::already_exists) return ERR_DUPLICATE;
  spdlog::error("SchedRegisterExternalEvent: {}", registered.error().describe());
  return ERR_NOMEMORY;
}

RTS_RESULT ApplicationHost::unregister_event(RTS_HANDLE event) {
  if (collected_ != nullptr && events_.is_own(event)) {
    return std::erase(collected_->events, event) == 0 ? ERR_NO_OBJECT : ERR_OK;
  }
  // The plc_app_exit of a version that leaves: the registration belongs to the one that runs on.
  if (online_ && is_of_running(event)) return ERR_NO_OBJECT;
  const auto done = events_.unregister_by_application(event);
  if (!done) return done.error().code == ErrorCode::not_found ? ERR_NO_OBJECT : ERR_PARAMETER;
  for (auto* const events : {&declaration_.events, &late_events_, &leaving_events_}) {
    std::erase(*events, event);
  }
  return ERR_OK;
}

RTS_RESULT ApplicationHost::set_task_options(const char* task, const Task_Options* options) {
  if (collected_ == nullptr) {
    spdlog::error("plc_set_task_options: options are set in plc_app_init only");
    return ERR_NOTINITIALIZED;
  }
  auto settings = from_options(task, options);
  if (!settings) {
    spdlog::error("plc_set_task_options: {}", settings.error().describe());
    return ERR_PARAMETER;
  }
  if (has(collected_->task_options, settings->task, &TaskSettings::task)) return ERR_DUPLICATE;
  collected_->task_options.push_back(*std::move(settings));
  return ERR_OK;
}

RTS_RESULT ApplicationHost::add_callback(unsigned event, PF_EVENT_CALLBACK callback, void* user) {
  const bool known = event == EVT_ExternalEventTaskCreateDone ||
                     event == EVT_PrepareExternalEventTaskDelete || event == EVT_PrepareStart;
  if (!known || callback == nullptr) return ERR_PARAMETER;
  const EventCallback wanted{event, callback, user};
  if (collected_ != nullptr) {
    auto& said = collected_->callbacks;
    if (has(said, wanted)) return ERR_DUPLICATE;
    const auto others = std::ranges::count(callbacks_, true, &Callback::of_component);
    if (said.size() + static_cast<std::size_t>(others) == PLC_MAX_EVENT_CALLBACKS) return ERR_NOMEMORY;
    said.push_back(wanted);
    return ERR_OK;
  }
  if (has(callbacks_, wanted, &Callback::callback)) return ERR_DUPLICATE;
  if (callbacks_.size() == PLC_MAX_EVENT_CALLBACKS) return ERR_NOMEMORY;
  callbacks_.push_back({.callback = wanted, .of_component = in_component_});
  return ERR_OK;
}

RTS_RESULT ApplicationHost::remove_callback(unsigned event, PF_EVENT_CALLBACK callback, void* user) {
  const EventCallback wanted{event, callback, user};
  const bool removed =
      collected_ != nullptr
          ? std::erase(collected_->callbacks, wanted) != 0
          : std::erase_if(callbacks_, [&](const Callback& known) { return known.callback == wanted; }) != 0;
  return removed ? ERR_OK : ERR_NO_OBJECT;
}

void ApplicationHost::notify(unsigned event, const EVTPARAM_ExternalEventTask& parameter) {
  const auto now = callbacks_;  // a callback may register or unregister
  for (const auto& [callback, of_component] : now) {
    if (callback.event != event) continue;
    const ComponentCode code(*this, of_component);
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

}  // namespace plchost
