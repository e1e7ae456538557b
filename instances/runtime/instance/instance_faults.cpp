// The actions of an Instance when one of its tasks has a fault.

#include <algorithm>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "instances/runtime/application/build_of.hpp"
#include "instances/runtime/application/symbol_name.hpp"
#include "instances/runtime/instance/instance.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"
#include "shm/pages/exception_history.hpp"
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

ExceptionEntry entry_of(const TaskSet::Fault& fault, const std::string& application) {
  const FaultRecord& record = fault.record;
  ExceptionEntry entry = exception_entry(record, application, fault.name);
  entry.whole_application = fault.whole_application;
  const BackTrace& trace = fault.back_trace;
  const bool thrown = record.kind == FaultKind::cpp_exception;
  std::vector<CodePlace> places{{.address = record.address, .returned_to = thrown},
                                {.address = record.caller, .returned_to = true}};
  for (std::size_t i = 0; i < trace.count; ++i)
    places.push_back({.address = trace.addresses[i], .returned_to = thrown || i > 0});
  const std::vector<std::string> names = names_of(places);
  entry.symbol = names[0];
  if (entry.symbol.empty() && record.caller != 0) {
    entry.symbol = fmt::format("no code; called from {}", names[1]);
  }
  entry.symbol = bounded(entry.symbol);
  for (std::size_t i = 2; i < names.size(); ++i) {
    entry.back_trace.push_back(names[i].empty() ? fmt::format("{:#x}", places[i].address)
                                                : bounded(names[i]));
  }
  entry.back_trace_end = describe_end(fault.back_trace);
  return entry;
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
  while (const auto fault = tasks_->take_fault()) {
    make_outputs_safe(*fault);
    const std::string reason = keep_fault(*fault);
    if (fault->whole_application) {
      enter_exception(reason);
    } else {
      unbind(fault->task);  // nobody runs what is posted to it any more
    }
  }
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

// Logged, shown in the status page, and written down. The text about it.
std::string Instance::keep_fault(const TaskSet::Fault& fault) {
  ExceptionEntry entry = entry_of(fault, application_->path());
  add_circumstances(entry, fault.task);
  const std::string where = entry.symbol.empty() ? std::string() : fmt::format(" at {}", entry.symbol);
  std::string reason = fmt::format("task '{}': {}{}", entry.task, entry.text, where);
  spdlog::error("exception: {}", reason);
  page_->set_task_state(static_cast<std::uint32_t>(fault.task), PageTaskState::exception);
  const LaunchOptions& launch = options_.launch;
  if (!launch.run_directory.empty()) {
    keep_exceptions_of(launch.run_directory, launch.name, std::span(&entry, 1));
  }
  return reason;
}

void Instance::add_circumstances(ExceptionEntry& entry, std::size_t index) {
  const TaskConfig& task = application_->tasks()[index];
  entry.version = PLCHOST_VERSION;
  entry.build = build_of(application_->path());
  entry.scheduler = scheduler_;
  entry.settings =
      task_settings(task.kind, task.interval, task.iec_priority, cores_.size() == 1 ? cores_.front() : -1) +
      watchdog_of(task);
  const auto counters = page_->task(static_cast<std::uint32_t>(index)).counters.read();
  if (counters) entry.cycles = counters->cycles;
  entry.uptime_ns = (MonotonicClock::now() - begun_).count();
}

}  // namespace plchost
