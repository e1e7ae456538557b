#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "shm/pages/host_page.hpp"

namespace plchost {

// clang-format off
// The phases of one instance
// ==========================
//
// The steps between them, each with its trigger: kPhaseSteps in instance_phase.cpp, which manager/README.md shows.
//
//   down         no process. It stays so until an operator or the configuration starts it.
//   held         no process. It waits until the instances of `after` are up.
//   backing_off  no process. It waits for the end of the back-off, or for a process that another manager made.
//   setting_up   a process of this manager sets itself up. Limit: 30 s, then SIGKILL. Time in which other
//                programs keep it from its processor does not count.
//   adopting     a process that outlived its manager was asked for its status. Limit: 5 s. If it has a status
//                page, it then counts as up with a problem text: a manager stops no PLC for being unable to talk
//                to it. Without a page it is asked again every 2 s. If it was up before, or its set-up would be
//                over, it counts as up, in exception, until it answers. If it ends in the set-up that a load
//                began, the application before is set up again.
//   up           the process answers, or is believed to. The process itself reports its state.
//   ending       the process was asked to end. Limit: 38 s (a stop may take 10 s and 25 s), then SIGTERM, 2 s,
//                SIGKILL. An adopted process may be in this phase already.
//
// A phase may follow itself: a text changes, or a start fails again. When the process ends,
// restart_decision.hpp decides on the way out of a phase.
// clang-format on
enum class InstancePhase : std::uint8_t { down, held, backing_off, setting_up, adopting, up, ending };

[[nodiscard]] std::string_view to_string(InstancePhase phase) noexcept;

/// A step from one phase to another.
struct PhaseStep {
  InstancePhase from;
  InstancePhase to;
  std::string_view trigger;
};
/// The table of all steps.
[[nodiscard]] std::span<const PhaseStep> phase_steps() noexcept;

/// The table has this step, or both are the same.
[[nodiscard]] bool leads(InstancePhase from, InstancePhase to) noexcept;
/// A client may see `state` in that phase.
[[nodiscard]] bool shows(InstancePhase phase, InstanceState state) noexcept;
/// The objection to this step; empty: none.
[[nodiscard]] std::string wrong_step(InstancePhase from, InstancePhase to, InstanceState shown);

}  // namespace plchost
