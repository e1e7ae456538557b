#pragma once

/// The thin C++ layer over plc_app.h: an application in a few lines, C++17, nothing to link.
///
///     #include "plc_app.hpp"
///     using namespace std::chrono_literals;
///
///     static void setup(plc::Application& app) {
///       app.cyclic("Fill", 1, 10ms, [] { ... });
///       app.external("Stop", 0, "stop", [] { ... });
///     }
///     PLC_APPLICATION("Bottling", setup)
///
///     g++ -std=c++17 -shared -fPIC -I FOLDER_OF_THIS_FILE -o bottling.so bottling.cpp

#include <chrono>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <functional>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "plc_app.h"
#include "plc_variables.hpp"

namespace plc {

/// One line in the instance's log, in printf form, at most PLC_LOG_MAX_TEXT bytes. Any context; in a
/// real-time task keep to integers and texts.
__attribute__((format(printf, 1, 2))) inline void log(const char* format, ...) {
  char text[PLC_LOG_MAX_TEXT + 1];  // NOLINT(modernize-avoid-c-arrays): filled by vsnprintf
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  plc_log(PLC_LOG_INFO, text);
}

/// The name of the instance that runs this application. Any context.
inline std::string_view instance_name() noexcept {
  return plc_instance_name();
}

/// The text of [Application] Parameter.NAME in the instance's settings; nothing: it is not set. Any context.
inline std::optional<std::string_view> parameter(const char* name) noexcept {
  const char* const text = plc_parameter(name);
  return text == nullptr ? std::nullopt : std::optional<std::string_view>(text);
}

/// The clock of SysTimeGetNs(), see plc_app.h. Any context.
inline std::chrono::nanoseconds system_time() noexcept {
  RTS_SYSTIME ns = 0;
  SysTimeGetNs(&ns);
  return std::chrono::nanoseconds(ns);
}

/// A channel on which instances send each other blocks, see plc_app.h. Empty unless it was opened.
class Channel {
 public:
  Channel() noexcept = default;
  /// Control context.
  explicit Channel(const std::string& name) {
    RTS_RESULT result = ERR_OK;
    handle_ = plc_channel_open(name.c_str(), &result);
    if (result != ERR_OK) throw std::runtime_error("cannot open channel '" + name + "'");
  }

  // The rest in any context; results as in plc_app.h.
  RTS_RESULT send(unsigned to, const void* data, std::size_t size,
                  int priority = PLC_BLOCK_NORMAL) const noexcept {
    return plc_channel_send(handle_, to, priority, data, static_cast<unsigned>(size));
  }
  RTS_RESULT request(unsigned to, const void* data, std::size_t size, unsigned& correlation,
                     int priority = PLC_BLOCK_NORMAL) const noexcept {
    return plc_channel_request(handle_, to, priority, data, static_cast<unsigned>(size), &correlation);
  }
  RTS_RESULT reply(const Block_Info& request, const void* data, std::size_t size) const noexcept {
    return plc_channel_reply(handle_, &request, data, static_cast<unsigned>(size));
  }
  /// True: there was a block, and `info` describes it.
  bool receive(void* buffer, std::size_t size, Block_Info& info) const noexcept {
    info.dwSize = sizeof info;
    return plc_channel_receive(handle_, buffer, static_cast<unsigned>(size), &info) == ERR_OK;
  }

 private:
  RTS_HANDLE handle_ = RTS_INVALID_HANDLE;
};

/// The address of an instance of this host; PLC_NO_NODE: there is none of that name (yet). Any context.
inline unsigned node_address(const std::string& instance) noexcept {
  return plc_node_address(instance.c_str());
}

/// An external event that can be posted to. Empty until it comes from Application::open_event.
class ExternalEvent {
 public:
  ExternalEvent() noexcept = default;
  /// ERR_OK, or ERR_NO_TASK / ERR_NO_OBJECT, see plc_app.h. Any context.
  RTS_RESULT post() const noexcept { return SchedPostExternalEvent(handle_); }
  [[nodiscard]] RTS_HANDLE handle() const noexcept { return handle_; }

 private:
  friend class Application;
  explicit ExternalEvent(RTS_HANDLE handle) noexcept : handle_(handle) {}
  RTS_HANDLE handle_ = RTS_INVALID_HANDLE;
};

/// The side that registers the event of an external-event task.
enum class Registration { with_task, by_others };

/// A task of this application, while it runs. Empty until it comes from current() or find().
class Task {
 public:
  Task() noexcept = default;
  /// The one whose cycle runs on this thread; empty outside of one. Any context.
  [[nodiscard]] static Task current() noexcept { return Task(SchedGetCurrentTask()); }
  /// Empty: there is none of that name (yet). Any context.
  [[nodiscard]] static Task find(const char* name) noexcept {
    return Task(SchedGetTaskHandle(name, nullptr));
  }
  [[nodiscard]] explicit operator bool() const noexcept { return handle_ != RTS_INVALID_HANDLE; }
  [[nodiscard]] RTS_HANDLE handle() const noexcept { return handle_; }

  /// The interval that was set last; 0: not a cyclic task. Any context.
  [[nodiscard]] std::chrono::nanoseconds interval() const noexcept {
    RTS_I64 interval = 0;
    return std::chrono::nanoseconds(SchedGetTaskInterval(handle_, &interval) == ERR_OK ? interval : 0);
  }
  /// From when on it holds, and its range: see SchedSetTaskInterval. Any context.
  RTS_RESULT set_interval(std::chrono::nanoseconds interval) const noexcept {
    return SchedSetTaskInterval(handle_, interval.count());
  }
  /// One rising edge for an event task; see SchedRaiseEvent. Any context.
  RTS_RESULT raise_event() const noexcept { return SchedRaiseEvent(handle_); }

 private:
  explicit Task(RTS_HANDLE handle) noexcept : handle_(handle) {}
  RTS_HANDLE handle_ = RTS_INVALID_HANDLE;
};

/// The options of a task beyond its kind and priority; see Task_Options in plc_app.h. The settings of the
/// instance win.
struct TaskOptions {
  std::chrono::nanoseconds start_offset{0};  ///< cyclic: 0 to below the interval
  bool late_asap = false;       ///< cyclic: a late cycle runs at once, not at the next point of the grid
  bool drives_outputs = false;  ///< stopped in the first phase of a stop
  std::chrono::microseconds watchdog_time{0};  ///< 0: no watchdog of its own
  unsigned int watchdog_sensitivity = 1;
  unsigned int watchdog_omitted_cycles = 0;  ///< 0: off
  bool watchdog_stops_task_only = false;
};

/// The use of an area by a task; see Plc_Area_Use in plc_app.h.
struct AreaUse {
  std::string task;
  unsigned int offset = 0;  ///< output: the bytes that this task alone writes
  unsigned int bytes = 0;   ///< 0: none of its own
};

/// The options of an area beyond its name and flags; see Plc_Area in plc_app.h.
struct AreaOptions {
  std::vector<AreaUse> uses;  ///< empty: all tasks
  unsigned long layout = 0;   ///< retain, persistent: another number when T's members mean something else
};

/// A memory area that holds a T. Empty until it comes from Application::area, and usable from the first cycle
/// on. An input or output is usable only within cycles of tasks that use it, each of which sees its own copy.
template <class T>
class Area {
  static_assert(std::is_trivially_copyable_v<T>, "an area is copied byte by byte");
  static_assert(alignof(T) <= 8, "areas are aligned to 8 bytes");

 public:
  Area() noexcept = default;
  /// Null: see plc_area_address. Any context.
  [[nodiscard]] T* get() const noexcept { return static_cast<T*>(plc_area_address(handle_)); }
  [[nodiscard]] T& operator*() const noexcept { return *get(); }
  [[nodiscard]] T* operator->() const noexcept { return get(); }
  /// Any context.
  [[nodiscard]] Plc_Area_State state() const noexcept {
    Plc_Area_State state{};
    state.dwSize = sizeof state;
    plc_get_area_state(handle_, &state);
    return state;
  }

 private:
  friend class Application;
  explicit Area(RTS_HANDLE handle) noexcept : handle_(handle) {}
  RTS_HANDLE handle_ = RTS_INVALID_HANDLE;
};

/// Whether plc_app_init or plc_app_exit, as which the setup and on_exit run, are part of an online change:
/// see plc_online_change. Control context.
inline bool online_change() noexcept {
  return plc_online_change() != 0;
}

/// Both stamps in nanoseconds and of the same instant: see SchedReportReferenceTime. Any context.
inline RTS_RESULT report_reference_time(std::chrono::nanoseconds reference,
                                        std::chrono::nanoseconds local) noexcept {
  return SchedReportReferenceTime(reference.count(), local.count());
}

/// How well the distributed clock goes, as seen from `task`; empty: from the cyclic task of the highest
/// priority. Any context.
[[nodiscard]] inline Clock_State clock_state(Task task = {}) noexcept {
  Clock_State state{};
  state.dwSize = sizeof state;
  SchedGetClockState(task.handle(), &state);
  return state;
}

/// Why a call of the set-up was refused, in words.
inline std::string reason_of(RTS_RESULT result) {
  switch (result) {
    case ERR_PARAMETER:
      return "a name or a value is not allowed (the log names it)";
    case ERR_DUPLICATE:
      return "it is there already";
    case ERR_NOMEMORY:
      return "there is no room for one more";
    case ERR_NOTINITIALIZED:
      return "this is for the setup function only";
    default:
      return "result " + std::to_string(result);
  }
}

/// The tasks of one application. Filled by the setup function, which runs once on the control thread before
/// any task. Faults (a text too long) are exceptions there: they refuse the application with their text.
class Application {
 public:
  using Cycle = std::function<void()>;
  using Variable = std::function<bool()>;

  explicit Application(const std::string& name) { copy(setup_.stApplicationName, name, "application"); }

  /// A task of any kind of plc_app.h; the functions below have one kind each. The members of Task_Info that
  /// the kind uses are set in the result, which is valid until another task is added. Priorities everywhere:
  /// 0 (highest) to 31, of which 0..15 are real-time.
  Task_Info& task(const std::string& name, int priority, short kind, Cycle cycle) {
    if (tasks_.size() >= PLC_MAX_TASKS) {
      throw std::length_error("more than " + std::to_string(PLC_MAX_TASKS) + " tasks");
    }
    if (priority < 0 || priority > 31) {
      throw std::invalid_argument("task '" + name + "': priority must be 0 (highest) to 31");
    }
    if (!cycle) throw std::invalid_argument("task '" + name + "': its cycle is an empty function");
    Task_Info added{};
    copy(added.stName, name, "task");
    added.nPriority = static_cast<short>(priority);
    added.KindOfTask = kind;
    added.dwTaskEntryFunctionPointer = &run_current;
    cycles_.push_back(std::move(cycle));
    variables_.emplace_back();
    tasks_.push_back(added);
    return tasks_.back();
  }

  /// Every `interval`.
  void cyclic(const std::string& name, int priority, std::chrono::microseconds interval, Cycle cycle) {
    if (interval.count() <= 0 || interval.count() > std::numeric_limits<unsigned int>::max()) {
      throw std::invalid_argument("task '" + name + "': interval must be 1 us to 4294 s");
    }
    Task_Info& added = task(name, priority, Cyclic, std::move(cycle));
    added.bMicroseconds = 1;
    added.dwInterval = static_cast<unsigned int>(interval.count());
  }

  /// Once each time `variable` goes from false to true. `variable` is called by the scheduler and only reads:
  /// values that other tasks write and it reads should be std::atomic.
  void event(const std::string& name, int priority, Variable variable, Cycle cycle) {
    if (!variable)
      throw std::invalid_argument("task '" + name + "': its event variable is an empty function");
    Task_Info& added = task(name, priority, Event, std::move(cycle));
    added.dwEventFunctionPointer = &read_current;
    variables_.back() = std::move(variable);
  }

  /// Once for each post of the external event `event`, which is registered, too, unless said otherwise.
  void external(const std::string& name, int priority, const std::string& event, Cycle cycle,
                Registration registration = Registration::with_task) {
    Task_Info& added = task(name, priority, External, std::move(cycle));
    copy(added.stExternalEvent, event, "external event");
    if (registration == Registration::with_task) to_register_.push_back(event);
  }

  /// In a loop, sleeping a share of its execution time.
  void freewheeling(const std::string& name, int priority, Cycle cycle) {
    task(name, priority, Freewheeling, std::move(cycle));
  }

  /// The options of a task of this application.
  void options(const std::string& task, const TaskOptions& wanted) {
    constexpr long kMaxTime = std::numeric_limits<unsigned int>::max();
    if (wanted.watchdog_time.count() < 0 || wanted.watchdog_time.count() > kMaxTime) {
      throw std::invalid_argument("task '" + task + "': watchdog_time must be 0 to 4294 s");
    }
    Task_Options options{};
    options.dwSize = sizeof options;
    options.nStartOffsetNs = wanted.start_offset.count();
    options.nLatePolicy = wanted.late_asap ? PLC_LATE_ASAP : PLC_LATE_NEXT;
    options.bDrivesOutputs = wanted.drives_outputs ? 1 : 0;
    options.dwWatchdogTimeUs = static_cast<unsigned int>(wanted.watchdog_time.count());
    options.dwWatchdogSensitivity = wanted.watchdog_sensitivity;
    options.dwWatchdogOmittedCycles = wanted.watchdog_omitted_cycles;
    options.nWatchdogPolicy = wanted.watchdog_stops_task_only ? PLC_WATCHDOG_TASK : PLC_WATCHDOG_APPLICATION;
    const RTS_RESULT result = plc_set_task_options(task.c_str(), &options);
    if (result != ERR_OK) {
      throw std::runtime_error("options of task '" + task + "' are refused: " + reason_of(result));
    }
  }

  /// Declares an area of `flags` (PLC_AREA_...), which begins with `initial` unless it has retain values.
  template <class T>
  Area<T> area(const std::string& name, unsigned int flags, const T& initial = T{},
               const AreaOptions& options = {}) {
    std::vector<Plc_Area_Use> uses;
    for (const AreaUse& use : options.uses)
      uses.push_back({use.task.c_str(), use.offset, use.bytes, nullptr});
    Plc_Area area{};
    area.dwSize = sizeof area;
    area.dwFlags = flags;
    area.pszName = name.c_str();
    area.dwBytes = sizeof(T);
    area.nUses = static_cast<unsigned int>(uses.size());
    area.pUses = uses.data();
    area.pInitial = &initial;
    area.qwLayout = options.layout;
    RTS_RESULT result = ERR_OK;
    const RTS_HANDLE handle = plc_declare_area(&area, &result);
    if (handle == RTS_INVALID_HANDLE) {
      throw std::runtime_error("area '" + name + "' is refused: " + reason_of(result));
    }
    return Area<T>(handle);
  }

  /// Variables that an online change carries over: a struct with the state of the machine, say. They are
  /// copied byte by byte to where the next version of the program has those of this name. `layout`: another
  /// number when T's members mean something else. Nothing in it points into the program.
  template <class T>
  void keep(const std::string& name, T& variables, unsigned long layout = 0) {
    static_assert(std::is_trivially_copyable_v<T>, "variables are copied byte by byte");
    static_assert(!std::is_const_v<T>, "variables are written by an online change");
    const RTS_RESULT result = plc_keep_variables(name.c_str(), &variables, sizeof variables, layout);
    if (result != ERR_OK) {
      throw std::runtime_error("variables '" + name + "' are refused: " + reason_of(result));
    }
  }

  /// A variable that can be seen from outside by its name, and written and forced unless it is const. It may
  /// be a number, a bool, std::chrono::nanoseconds (TIME), a char (CHAR), a char16_t (WCHAR), or an
  /// std::atomic of those. Or it is an array: of char a STRING, of char16_t a WSTRING. An array's dimensions
  /// are counted from options.first. BYTE to LWORD, DATE, TOD and DT are options.type of an integer. Static,
  /// or as long-lived.
  template <class T>
  void variable(const std::string& name, T& variable, const VariableOptions& options = {}) {
    Plc_Variable declared{};
    declared.dwSize = sizeof declared;
    detail::VariableLayout<T>::fill(declared);
    std::string full = name;
    for (unsigned i = 0; i < declared.nDimensions; ++i) {
      declared.aDimensions[i].nFirst = options.first;
      if (name.find('[') == std::string::npos) full += "[]";
    }
    if (options.type != 0) declared.dwType = options.type;
    declared.pszName = full.c_str();
    declared.dwFlags = options.read_only || std::is_const_v<T> ? PLC_VARIABLE_READ_ONLY : 0;
    declared.pAddress = const_cast<void*>(static_cast<const volatile void*>(&variable));
    declared.pszTask = options.task.empty() ? nullptr : options.task.c_str();
    declared.pszArea = options.area.empty() ? nullptr : options.area.c_str();
    const RTS_RESULT result = plc_declare_variable(&declared);
    if (result != ERR_OK) {
      throw std::runtime_error("variable '" + name + "' is refused: " + reason_of(result));
    }
  }

  /// Registers an own event ("ready"), or gives access to one of another instance ("packer1/product").
  ExternalEvent open_event(const std::string& name) {
    RTS_RESULT result = ERR_OK;
    const RTS_HANDLE handle = SchedRegisterExternalEvent(name.c_str(), &result);
    if (handle == RTS_INVALID_HANDLE) {
      throw std::runtime_error("external event '" + name + "' cannot be had: " + reason_of(result));
    }
    return ExternalEvent(handle);
  }

  /// Runs once when all tasks have ended, or after an online change when another version has taken over from
  /// this one: then online_change() is true, and the machine runs on.
  void on_exit(std::function<void()> action) { exit_ = std::move(action); }

  /// Called by the code of PLC_APPLICATION.
  template <class Setup>
  int init(Setup&& setup) noexcept {
    try {
      current() = this;
      std::forward<Setup>(setup)(*this);
      if (tasks_.empty()) throw std::invalid_argument("the setup function makes no task");
      setup_.nTasks = static_cast<short>(tasks_.size());
      setup_.ptaskinfo = tasks_.data();
      __sys__setup__tasks(&setup_);
      for (const std::string& event : to_register_) open_event(event);
      return 0;
    } catch (const std::exception& error) {
      plc_log(PLC_LOG_ERROR, error.what());
    } catch (...) {
      plc_log(PLC_LOG_ERROR, "the setup function threw something that is no std::exception");
    }
    return 1;
  }
  void exit() noexcept {
    if (exit_) exit_();
  }

 private:
  // plc_app.h's functions have no argument: all tasks share these two, which look up whose turn it is.
  static void run_current() { current()->cycles_[index_of_current()](); }
  static unsigned char read_current() { return current()->variables_[index_of_current()]() ? 1 : 0; }

  static std::size_t index_of_current() noexcept {
    return static_cast<std::size_t>(plc_current_task() - current()->tasks_.data());
  }
  // Each program's own, also if it is built with symbols that exist once in a process: hidden.
  __attribute__((visibility("hidden"))) static Application*& current() noexcept {
    static Application* application = nullptr;
    return application;
  }

  template <std::size_t Size>
  static void copy(char (&to)[Size], const std::string& from, const char* what) {
    if (from.size() >= Size) {
      throw std::invalid_argument(std::string(what) + " name '" + from + "' is longer than " +
                                  std::to_string(Size - 1) + " characters");
    }
    std::memcpy(to, from.c_str(), from.size() + 1);
  }

  std::vector<Task_Info> tasks_;
  std::vector<Cycle> cycles_;        // parallel to tasks_
  std::vector<Variable> variables_;  // parallel to tasks_; empty unless the task is an event task
  std::vector<std::string> to_register_;
  std::function<void()> exit_;
  sys_setup_tasks_struct setup_{};
};

}  // namespace plc

/// Exports what plc-instance looks for. `setup` is called with a plc::Application&. Once per application.
#define PLC_APPLICATION(name, setup)               \
  static plc::Application& plc_the_application() { \
    static plc::Application application(name);     \
    return application;                            \
  }                                                \
  PLC_EXPORT_ABI;                                  \
  int plc_app_init(void) {                         \
    return plc_the_application().init(setup);      \
  }                                                \
  void plc_app_exit(void) {                        \
    plc_the_application().exit();                  \
  }
