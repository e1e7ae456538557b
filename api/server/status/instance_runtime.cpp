#include "api/server/status/instance_runtime.hpp"

#include <cstdint>

#include <code_words.hpp>
#include <fmt/format.h>

#include "api/dds/text.hpp"
#include "api/server/status/host_grid.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

// The states of control.idl; a stranger may have written another one.
constexpr std::uint32_t kClockStates = dds::words::InstanceStatus::clock_state.size();

void add(std::string& problem, std::string_view more) {
  if (more.empty()) return;
  problem += problem.empty() ? "" : "; ";
  problem += more;
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
  sample.variables = runtime.variables;
  sample.forces = runtime.forces;
  put_clock(runtime.clock, sample);
}

std::string problem_of_instance(const InstanceStatus& status, const InstanceRuntime* runtime) {
  std::string problem(status.problem.view());
  if (runtime == nullptr || runtime->pid != status.pid) return problem;
  add(problem, runtime->retain_problem.view());
  if (runtime->forces > 0)
    add(problem, count_text(runtime->forces, "variable is", "variables are") + " forced");
  return problem;
}

}  // namespace plchost
