#include "api/cli/plant/plant_changes.hpp"

#include <optional>
#include <utility>

#include <control.h>
#include <fmt/format.h>

#include "api/dds/code_names.hpp"
#include "shm/pages/host_page.hpp"

namespace plchost {

namespace {

/// The command that leads from a state to running, or to stopped; none: it is there.
std::optional<std::int32_t> way_to(bool to_running, InstanceState state) {
  switch (state) {
    using enum InstanceState;
    case safe_mode:
    case failed:
    case exception:
      return to_running ? plc_OPERATION_RESTART : plc_OPERATION_RESET;
    case running:
      return to_running ? std::nullopt : std::optional(plc_OPERATION_STOP);
    case offline:
    case stopped:
      return to_running ? std::optional(plc_OPERATION_START) : std::nullopt;
    case starting:
    case stopping:
    case waiting:
      break;
  }
  // On its way to somewhere, or of a newer host: it is waited for.
  return to_running ? plc_OPERATION_START : plc_OPERATION_STOP;
}

bool has_process(InstanceState state) {
  return state != InstanceState::offline && state != InstanceState::waiting && state != InstanceState::failed;
}

}  // namespace

std::vector<PlantChange> changes_to(const WantedInstance& wanted, const PresentInstance& present) {
  std::vector<PlantChange> changes;
  const bool other_application = !wanted.application.empty() && wanted.application != present.application;
  const auto present_state = static_cast<InstanceState>(present.state);
  std::optional<PlantChange> state;
  if (wanted.running) {
    if (const auto way = way_to(*wanted.running, present_state)) {
      state = PlantChange{"state", dds::instance_state_name(present.state),
                          *wanted.running ? "running" : "stopped", *way, ""};
    }
  }
  // The command that leads out of a fault ends the process; a loaded application does that, too, and better.
  const bool faulty = present_state == InstanceState::safe_mode || present_state == InstanceState::failed ||
                      present_state == InstanceState::exception;
  const bool early = state && (!*wanted.running || !has_process(present_state) || faulty);
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
