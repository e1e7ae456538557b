#include "api/cli/plant/plant_changes.hpp"

#include <optional>
#include <utility>

#include <control.h>
#include <fmt/format.h>

#include "api/dds/code_names.hpp"

namespace plchost {

namespace {

// InstanceStatus.state.
enum State : std::uint32_t {
  offline,
  starting,
  running,
  stopped,
  stopping,
  waiting,
  safe_mode,
  failed,
  exception
};

/// The command that leads from a state to running, or to stopped; none: it is there.
std::optional<std::int32_t> way_to(bool to_running, std::uint32_t state) {
  switch (state) {
    case safe_mode:
    case failed:
    case exception:
      return to_running ? plc_OPERATION_RESTART : plc_OPERATION_RESET;
    case running:
      return to_running ? std::nullopt : std::optional(plc_OPERATION_STOP);
    case offline:
    case stopped:
      return to_running ? std::optional(plc_OPERATION_START) : std::nullopt;
    default:  // on its way to somewhere; it is waited for
      return to_running ? plc_OPERATION_START : plc_OPERATION_STOP;
  }
}

bool has_process(std::uint32_t state) {
  return state != offline && state != waiting && state != failed;
}

}  // namespace

std::vector<PlantChange> changes_to(const WantedInstance& wanted, const PresentInstance& present) {
  std::vector<PlantChange> changes;
  const bool other_application = !wanted.application.empty() && wanted.application != present.application;
  std::optional<PlantChange> state;
  if (wanted.running) {
    if (const auto way = way_to(*wanted.running, present.state)) {
      state = PlantChange{"state", dds::instance_state_name(present.state),
                          *wanted.running ? "running" : "stopped", *way, ""};
    }
  }
  // The command that leads out of a fault ends the process; a loaded application does that, too, and better.
  const bool faulty = present.state == safe_mode || present.state == failed || present.state == exception;
  const bool early = state && (!*wanted.running || !has_process(present.state) || faulty);
  if (early && !(faulty && other_application)) changes.push_back(*std::exchange(state, std::nullopt));
  if (other_application) {
    changes.push_back({"application", present.application, wanted.application, plc_OPERATION_LOAD_APPLICATION,
                       wanted.application});
    // It runs then, unless it was stopped before.
    if (faulty) state.reset();
  }
  if (!wanted.scheduler.empty() && wanted.scheduler != present.scheduler) {
    changes.push_back(
        {"scheduler", present.scheduler, wanted.scheduler, plc_OPERATION_SET_SCHEDULER, wanted.scheduler});
  }
  for (const std::string& event : wanted.events) {
    if (present.events.contains(event)) continue;
    changes.push_back({fmt::format("event {}", event), "not registered", "registered",
                       plc_OPERATION_REGISTER_EVENT, event});
  }
  if (state) changes.push_back(*std::move(state));
  return changes;
}

}  // namespace plchost
