#include "api/server/status/instance_runtime.hpp"

#include <cstdint>

#include <fmt/format.h>

#include "api/dds/text.hpp"

namespace plchost {

namespace {

// The states of control.idl; a stranger may have written another one.
constexpr std::uint32_t kClockStates = 6;

// A value that moves by a little with each look would make each look news.
std::int64_t to_hundreds(std::int64_t value) noexcept {
  constexpr std::int64_t kHundred = 100;
  return (value + (value < 0 ? -kHundred / 2 : kHundred / 2)) / kHundred * kHundred;
}

void put_clock(const ClockRuntime& clock, plc_InstanceStatus& sample) noexcept {
  dds::copy_text(sample.clock_reference, clock.reference.view());
  dds::copy_text(sample.clock_problem, clock.problem.view());
  if (clock.state == 0 || clock.state >= kClockStates) return;
  sample.clock_state = clock.state;
  sample.clock_in_sync = clock.in_sync != 0;
  sample.clock_offset_ns = to_hundreds(clock.offset_ns);
  sample.clock_drift_ppb = to_hundreds(clock.drift_ppb);
  sample.clock_correction_max_ns = clock.correction_max_ns;
  sample.clock_corrections_at_bound = clock.corrections_at_bound;
  sample.clock_rejected_pairs = clock.rejected;
  sample.clock_invalid_pairs = clock.invalid;
  sample.clock_steps = clock.steps;
}

}  // namespace

void put_runtime(const InstanceRuntime& runtime, plc_InstanceStatus& sample) noexcept {
  dds::copy_text(sample.tick_source, runtime.tick_source.view());
  dds::copy_text(sample.tick_fallback, runtime.tick_fallback.view());
  dds::copy_text(sample.idle_states, runtime.idle_states.view());
  put_clock(runtime.clock, sample);
}

std::string problem_of_instance(const InstanceStatus& status, const InstanceRuntime* runtime) {
  std::string problem(status.problem.view());
  if (runtime == nullptr || runtime->pid != status.pid) return problem;
  const std::string_view retain = runtime->retain_problem.view();
  return problem.empty() || retain.empty() ? problem.append(retain) : fmt::format("{}; {}", problem, retain);
}

}  // namespace plchost
