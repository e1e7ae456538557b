// The actions of an Instance when one of its tasks has a fault.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "instances/runtime/application/symbol_name.hpp"
#include "instances/runtime/instance/instance.hpp"
#include "shm/base/names.hpp"
#include "shm/base/time.hpp"
#include "shm/log/log.hpp"
#include "shm/pages/exception_history.hpp"
#include "shm/pages/flight_activity.hpp"
#include "shm/plc_process_image.h"

namespace plchost {

namespace {

// The names of C++ templates have no bound. A cut one keeps its offset and its file, if they are short.
constexpr std::size_t kMostOfAName = 255;

std::string bounded(const std::string& name) {
  constexpr std::string_view kCut = "...";
  const std::size_t offset = std::min(name.rfind("+0x"), name.size());
  const std::size_t tail = name.size() - offset;
  if (name.size() <= kMostOfAName || tail > kMostOfAName / 2) return shortened(name, kMostOfAName);
  const std::string_view head = cut(name, kMostOfAName - tail - kCut.size());
  return fmt::format("{}{}{}", head, kCut, std::string_view(name).substr(offset));
}

// As well as they are found until `deadline`.
void name_functions(ExceptionEntry& entry, const TaskSet::Fault& fault, TimePoint deadline) {
  const FaultRecord& record = fault.record;
  const BackTrace& trace = fault.back_trace;
  const bool thrown = record.kind == FaultKind::cpp_exception;
  std::vector<CodePlace> places{{.address = record.address, .returned_to = thrown},
                                {.address = record.caller, .returned_to = true}};
  for (std::size_t i = 0; i < trace.count; ++i)
    places.push_back({.address = trace.addresses[i], .returned_to = thrown || i > 0});
  const std::vector<std::string> names = names_of(places, deadline);
  entry.symbol = names[0];
  if (entry.symbol.empty() && record.caller != 0) {
    entry.symbol = fmt::format("no code; called from {}", names[1]);
  }
  entry.symbol = bounded(entry.symbol);
  entry.back_trace.clear();
  for (std::size_t i = 2; i < names.size(); ++i) {
    entry.back_trace.push_back(names[i].empty() ? fmt::format("{:#x}", places[i].address)
                                                : bounded(names[i]));
  }
}

// No file is read for it: see Instance::name_faults().
ExceptionEntry entry_of(const TaskSet::Fault& fault, const std::string& application) {
  ExceptionEntry entry = exception_entry(fault.record, application, fault.name);
  entry.whole_application = fault.whole_application;
  name_functions(entry, fault, TimePoint::min());
  entry.back_trace_end = describe_end(fault.back_trace);
  return entry;
}

std::string reason_of(const ExceptionEntry& entry) {
  const std::string where = entry.symbol.empty() ? std::string() : fmt::format(" at {}", entry.symbol);
  return fmt::format("task '{}': {}{}", entry.task, entry.text, where);
}

std::string_view to_string(WatchdogPolicy policy) noexcept {
  return policy == WatchdogPolicy::task ? "the task" : "the application";
}

std::string watchdog_of(const TaskConfig& task) {
  const TaskWatchdog& watchdog = task.watchdog;
  constexpr double kNsPerMs = 1e6;
  std::string text;
  if (watchdog.time > Duration::zero())
    text += fmt::format(", watchdog {:g} ms x {}", static_cast<double>(watchdog.time.count()) / kNsPerMs,
                        watchdog.sensitivity);
  if (watchdog.omitted_cycles > 0) text += fmt::format(", omitted cycles {}", watchdog.omitted_cycles);
  return text + fmt::format(", a fault stops {}", to_string(watchdog.policy));
}

}  // namespace

void Instance::serve_faults() {
  KeptFaults kept;
  while (const auto fault = tasks_->take_fault()) {
    make_outputs_safe(*fault);
    kept.emplace_back(*fault, keep_fault(*fault));
    if (fault->whole_application) {
      enter_exception(reason_of(kept.back().second));
    } else {
      unbind(fault->task);  // nobody runs what is posted to it any more
      // Other tasks wait for the end of its cycle with what belongs to both.
      std::atomic_ref(application_->info(fault->task).tLastCycleTime).store(-1, std::memory_order_release);
    }
  }
  name_faults(kept);
}

// Before it is written down: the disk may not answer, and a task that was caught can hold a lock of the heap.
void Instance::make_outputs_safe(const TaskSet::Fault& fault) {
  SafeOutputs& outputs = host_->areas().outputs();
  if (fault.whole_application) {
    outputs.put_safe(PLC_IMAGE_STATE_EXCEPTION);
  } else {
    outputs.task_fails(fault.task);
  }
}

// Logged, shown in the status page, and written down.
ExceptionEntry Instance::keep_fault(const TaskSet::Fault& fault) {
  page_->set_task_state(static_cast<std::uint32_t>(fault.task), PageTaskState::exception);
  ExceptionEntry entry = entry_of(fault, application_->path());
  entry.circumstances = circumstances_of(fault.task);
  if (flight_) entry.activity = activity_before(*flight_, fault.time);
  spdlog::error("exception: {}", reason_of(entry));
  write_down(entry);
  return entry;
}

// Functions that are not exported, and lines: large debug information takes a while, and all else waits.
void Instance::name_faults(const KeptFaults& kept) const {
  constexpr Duration kLimit = std::chrono::milliseconds(300);
  const TimePoint deadline = MonotonicClock::now() + kLimit;
  for (const auto& [fault, known] : kept) {
    ExceptionEntry entry = known;
    name_functions(entry, fault, deadline);
    if (entry == known) continue;
    if (entry.symbol != known.symbol) spdlog::error("exception: task '{}': at {}", entry.task, entry.symbol);
    write_down(entry);
  }
}

void Instance::write_down(const ExceptionEntry& entry) const {
  const LaunchOptions& launch = options_.launch;
  if (launch.run_directory.empty()) return;
  keep_exceptions_of(launch.run_directory, launch.name, std::span(&entry, 1));
}

ExceptionCircumstances Instance::circumstances_of(std::size_t index) {
  const TaskConfig& task = application_->tasks()[index];
  ExceptionCircumstances now;
  now.version = PLCHOST_VERSION;
  now.build = application_->build();
  now.scheduler = scheduler_;
  now.settings =
      task_settings(task.kind, task.interval, task.iec_priority, cores_.size() == 1 ? cores_.front() : -1) +
      watchdog_of(task);
  const auto counters = page_->task(static_cast<std::uint32_t>(index)).counters.read();
  if (counters) now.cycles = counters->cycles;
  now.uptime_ns = (MonotonicClock::now() - begun_).count();
  return now;
}

}  // namespace plchost
