#include "shm/base/fault_record.hpp"

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <memory>
#include <utility>

#include <cxxabi.h>
#include <fmt/format.h>

#include "shm/base/names.hpp"

namespace plchost {

namespace {

double ms(std::int64_t ns) noexcept {
  constexpr double kNsPerMs = 1e6;
  return static_cast<double>(ns) / kNsPerMs;
}

std::string demangle(const FixedText<FaultRecord::kMaxText>& type) {
  int status = 0;
  const std::unique_ptr<char, decltype(&std::free)> name(
      abi::__cxa_demangle(std::string(type.view()).c_str(), nullptr, nullptr, &status), &std::free);
  return name ? std::string(name.get()) : std::string("an exception");
}

std::string_view what_of(int signal, int code) noexcept {
  switch (signal) {
    case SIGSEGV:
      if (code == SI_KERNEL) return "access through a wild pointer; its address is not known";
      return code == SEGV_ACCERR ? "access that the memory does not allow" : "access to no memory";
    case SIGBUS:
      return "access to memory that is not there";
    case SIGFPE:
      return code == FPE_INTDIV ? "integer division by zero or overflow" : "arithmetic fault";
    case SIGILL:
      return "illegal instruction";
    case SIGTRAP:
      return "breakpoint without a debugger";
    case SIGABRT:
      return "abort";
    default:
      return "fault";
  }
}

std::string describe_signal(const FaultRecord& record) {
  if (record.stack_overflow) return fmt::format("SIGSEGV: stack overflow at {:#x}", record.memory_address);
  std::string text =
      fmt::format("{}: {}", signal_name(record.signal), what_of(record.signal, record.signal_code));
  const bool names_memory = record.signal == SIGSEGV || record.signal == SIGBUS;
  if (!names_memory || record.signal_code <= 0 || record.signal_code == SI_KERNEL) return text;
  return fmt::format("{} at {:#x}", text, record.memory_address);
}

std::string_view name_of(StopPhase phase) noexcept {
  switch (phase) {
    case StopPhase::outputs:
      return "the first phase of a stop (tasks that drive outputs)";
    case StopPhase::others:
      return "the second phase of a stop (tasks that drive no outputs)";
    case StopPhase::single_cycle:
      return "a single cycle of all tasks";
  }
  return "a stop";
}

}  // namespace

std::string_view to_string(FaultKind kind) noexcept {
  switch (kind) {
    case FaultKind::signal:
      return "signal";
    case FaultKind::cpp_exception:
      return "cpp_exception";
    case FaultKind::task_watchdog:
      return "task_watchdog";
    case FaultKind::consecutive_overruns:
      return "consecutive_overruns";
    case FaultKind::omitted_cycles:
      return "omitted_cycles";
    case FaultKind::processor_load:
      return "processor_load";
    case FaultKind::stop_timeout:
      return "stop_timeout";
    case FaultKind::no_processor:
      return "no_processor";
  }
  return "unknown";
}

TimePoint time_of_fault(std::int64_t unix_ns) noexcept {
  const std::int64_t now = std::max<std::int64_t>(unix_time_ns(), 0);  // first: dated late rather than early
  return MonotonicClock::now() - Duration(now - std::clamp<std::int64_t>(unix_ns, 0, now));
}

std::string describe_end(const BackTrace& trace) {
  switch (trace.end) {
    case BackTrace::End::none:
      return "nothing has stopped the thread within its code";
    case BackTrace::End::whole:
      return {};
    case BackTrace::End::deep:
      return fmt::format("only the innermost {} functions are known", BackTrace::kMost);
    case BackTrace::End::lost:
      return "the caller of the last function is not known: it has no unwind tables, or the stack is "
             "overwritten";
    case BackTrace::End::damaged:
      return "the stack is overwritten: it leads to memory that cannot be read";
  }
  return "not known";
}

std::string signal_name(int signal) {
  constexpr std::array kNames = {
      std::pair{SIGSEGV, "SIGSEGV"}, std::pair{SIGBUS, "SIGBUS"},   std::pair{SIGFPE, "SIGFPE"},
      std::pair{SIGILL, "SIGILL"},   std::pair{SIGTRAP, "SIGTRAP"}, std::pair{SIGABRT, "SIGABRT"},
  };
  for (const auto& [number, name] : kNames) {
    if (number == signal) return name;
  }
  return fmt::format("signal {}", signal);
}

std::string describe_fault(const FaultRecord& record) {
  const std::string_view where = record.in_event_variable ? " in its event variable" : "";
  const std::string_view runs_on =
      record.not_caught
          ? "; its thread could not be caught and runs on: it blocks signals, or gets no processor time"
          : "";
  switch (record.kind) {
    case FaultKind::signal:
      return describe_signal(record) + std::string(where);
    case FaultKind::cpp_exception:
      return fmt::format("{} left {}: {}", demangle(record.type),
                         record.in_event_variable ? "its event variable" : "its cycle", record.text.view());
    case FaultKind::task_watchdog:
      return fmt::format("still running{} after {:.3f} ms; the limit is {:.3f} ms{}", where,
                         ms(record.figure), ms(record.limit), runs_on);
    case FaultKind::consecutive_overruns:
      return fmt::format("{} took longer than {:.3f} ms, the last {:.3f} ms",
                         count_text(static_cast<std::uint64_t>(record.count), "cycle", "cycles in a row"),
                         ms(record.limit), ms(record.figure));
    case FaultKind::omitted_cycles:
      return fmt::format(
          "{} passed without a cycle; the limit is {}{}",
          count_text(static_cast<std::uint64_t>(record.figure), "release", "releases in a row"), record.limit,
          runs_on);
    case FaultKind::processor_load:
      return fmt::format("the instance used {} % of its core; the limit is {} %. This task used the most",
                         record.figure, record.limit);
    case FaultKind::stop_timeout:
      return fmt::format(
          "{} after {:.0f} ms, the limit of {}",
          record.in_event_variable ? "its event variable has not returned" : "not at the end of its cycle",
          ms(record.limit), name_of(record.phase));
    case FaultKind::no_processor:
      return fmt::format(
          "ready to run for {:.0f} ms without the processor, which {} of the application took; the limit is "
          "{:.0f} ms. That thread has no real-time priority any more",
          ms(record.figure), record.text.view(), ms(record.limit));
  }
  return "unknown";
}

}  // namespace plchost
