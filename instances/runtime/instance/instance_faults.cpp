// The actions of an Instance when one of its tasks has a fault.

#include <algorithm>
#include <span>
#include <string>
#include <string_view>

#include <fmt/format.h>

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
  SymbolNames names;
  entry.symbol = names.at(record.address);
  if (entry.symbol.empty() && record.caller != 0) {
    entry.symbol = fmt::format("no code; called from {}", names.at(record.caller));
  }
  entry.symbol = bounded(entry.symbol);
  for (std::size_t i = 0; i < fault.back_trace.count; ++i) {
    const std::uint64_t address = fault.back_trace.addresses[i];
    const std::string name = names.at(address, i > 0);
    entry.back_trace.push_back(name.empty() ? fmt::format("{:#x}", address) : bounded(name));
  }
  entry.back_trace_end = describe_end(fault.back_trace);
  return entry;
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
  const ExceptionEntry entry = entry_of(fault, application_->path());
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

}  // namespace plchost
