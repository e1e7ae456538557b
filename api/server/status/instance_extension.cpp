#include "api/server/status/instance_extension.hpp"

#include <array>
#include <cstdint>
#include <string_view>

#include <fmt/format.h>

#include "api/dds/entries.hpp"
#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"

namespace plchost {

namespace {

constexpr std::array<std::string_view, 6> kClockStates = {"off",    "free running", "acquiring",
                                                          "locked", "hold-over",    "measured, not steered"};

// A value that moves by a little with each look would make each look news.
std::int64_t to_hundreds(std::int64_t value) noexcept {
  constexpr std::int64_t kHundred = 100;
  return (value + (value < 0 ? -kHundred / 2 : kHundred / 2)) / kHundred * kHundred;
}

template <class Add>
void add_clock(const ClockRuntime& clock, const Add& add) {
  add("clock_reference", clock.reference.view());
  add("clock_problem", clock.problem.view());
  if (clock.state == 0 || clock.state >= kClockStates.size()) return;
  add("clock_state", kClockStates[clock.state]);
  add("clock_in_sync", clock.in_sync != 0 ? "1" : "0");
  add("clock_offset_ns", fmt::format("{}", to_hundreds(clock.offset_ns)));
  add("clock_drift_ppb", fmt::format("{}", to_hundreds(clock.drift_ppb)));
  add("clock_correction_max_ns",
      fmt::format("{}, {} times at the bound", clock.correction_max_ns, clock.corrections_at_bound));
  add("clock_rejected_pairs",
      fmt::format("{}, {} not valid, {} steps followed", clock.rejected, clock.invalid, clock.steps));
}

}  // namespace

std::vector<plc_KeyValue> extension_of(const InstanceRuntime& runtime) {
  std::vector<plc_KeyValue> entries;
  const auto add = [&](std::string_view name, std::string_view value) {
    dds::add_entry(entries, name, value);
  };
  add("tick_source", runtime.tick_source.view());
  add("tick_fallback", runtime.tick_fallback.view());
  add("idle_states", runtime.idle_states.view());
  add_clock(runtime.clock, add);
  return entries;
}

std::string problem_of_instance(const InstanceStatus& status, const InstanceRuntime* runtime) {
  std::string problem(status.problem.view());
  if (runtime == nullptr || runtime->pid != status.pid) return problem;
  const std::string_view retain = runtime->retain_problem.view();
  return problem.empty() || retain.empty() ? problem.append(retain) : fmt::format("{}; {}", problem, retain);
}

plc_KeyValue transitions_entry(std::uint64_t last) {
  plc_KeyValue entry{};
  dds::copy_text(entry.name, dds::kTransitionsEntry);
  dds::copy_text(entry.value, fmt::format("{}", last));
  return entry;
}

}  // namespace plchost
