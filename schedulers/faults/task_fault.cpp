#include "schedulers/faults/task_fault.hpp"

#include <algorithm>
#include <exception>
#include <typeinfo>

#include <cxxabi.h>

#include "schedulers/faults/fault_trap.hpp"

namespace plchost {

namespace {

// Both are the application's and may be faulty themselves: they are copied before the fault is claimed.
FixedText<FaultRecord::kMaxText> what_of_exception() noexcept {
  try {
    throw;
  } catch (const std::exception& error) {
    return FixedText<FaultRecord::kMaxText>(error.what());
  } catch (...) {
    return FixedText<FaultRecord::kMaxText>("not a std::exception");
  }
}

FixedText<FaultRecord::kMaxText> type_of_exception() noexcept {
  const std::type_info* const type = abi::__cxa_current_exception_type();
  return FixedText<FaultRecord::kMaxText>(type != nullptr ? type->name() : "");
}

}  // namespace

void raise_current_exception(TaskFault& fault, bool event_variable) noexcept {
  const auto what = what_of_exception();
  const auto type = type_of_exception();
  const BackTrace thrown = FaultTrap::take_thrown();
  if (!fault.claim(event_variable)) return;
  fault.back_trace() = thrown;
  FaultRecord& record = fault.record();
  record.address = thrown.count > 0 ? thrown.addresses[0] : 0;
  record.kind = FaultKind::cpp_exception;
  record.in_event_variable = event_variable;
  record.text = what;
  record.type = type;
  fault.publish();
}

void raise_stop_timeout(TaskFault& fault, StopPhase phase, Duration limit, bool event_variable) noexcept {
  if (!fault.claim(true)) return;
  FaultRecord& record = fault.record();
  record.kind = FaultKind::stop_timeout;
  record.phase = phase;
  record.in_event_variable = event_variable;
  record.limit = limit.count();
  fault.publish();
}

}  // namespace plchost
