#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "shm/pages/host_page.hpp"

namespace plchost {

// clang-format off
// The phases of one instance
// ==========================
//
//   down ── in order ──► held ── released ──► setting_up ── ready ──► up ◄── answered ── adopting
//    │                                         ▲     │               │                    ▲   │
//    ├── an operator's start ──────────────────┘     │ ended         │ ended              │   │ ended
//    │                                               ▼               ▼                    │   ▼
//    ├── ended unwatched ──────────────────────► backing_off ◄───────┴────────────────────┼── backing_off
//    │                                             │   │                                  │
//    │                          setting_up ◄── time is over └── a process of that name ───┤
//    └── a process that outlived its manager ─────────────────────────────────────────────┘
//
//   setting_up, adopting, up ── replaced or brought down ──► ending ──► setting_up, or down
//
//                 to: down  held  backing_off  setting_up  adopting  up   ending    shown as
//   from down          -     yes      yes          yes        yes    -     yes      offline, failed
//        held          yes   -        yes          yes        -      -     -        waiting
//        backing_off   yes   -        -            yes        yes    -     yes      waiting
//        setting_up    yes   -        yes          -          -      yes   yes      starting
//        adopting      yes   -        yes          yes        -      yes   yes      starting
//        up            yes   -        yes          -          -      -     yes      running, stopped, stopping,
//                                                                                   exception, safe_mode
//        ending        yes   -        yes          yes        -      -     -        stopping
//
//   down         no process. It stays so until an operator or the configuration starts it.
//   held         no process. It waits until the instances of `after` are up.
//   backing_off  no process. It waits for the end of the back-off, or for a process that another manager made.
//   setting_up   a process of this manager sets itself up. Limit: 30 s, then SIGKILL. Time in which other
//                programs keep it from its processor does not count.
//   adopting     a process that outlived its manager was asked for its status. Limit: 5 s; then it counts as
//                up with a problem text if it has a status page, because a manager stops no PLC for being unable
//                to talk to it. Without a page it is asked again every 2 s. If it was up before, or its set-up
//                would be over, it counts as up, in exception, until it answers. If it ends in the set-up that
//                a load began, the application before is set up again.
//   up           the process answers, or is believed to. The process itself reports its state.
//   ending       the process was asked to end. Limit: 38 s (a stop may take 10 s and 25 s), then SIGTERM, 2 s,
//                SIGKILL. An adopted process may be in this phase already.
//
// A phase may follow itself: a text changes, or a start fails again. When the process ends,
// restart_decision.hpp decides on the way out of a phase.
// clang-format on
enum class InstancePhase : std::uint8_t { down, held, backing_off, setting_up, adopting, up, ending };
inline constexpr std::uint8_t kInstancePhases = 7;

[[nodiscard]] std::string_view to_string(InstancePhase phase) noexcept;

/// The table has "yes", or both are the same.
[[nodiscard]] bool leads(InstancePhase from, InstancePhase to) noexcept;
/// The table says that a client may see `state` in that phase.
[[nodiscard]] bool shows(InstancePhase phase, InstanceState state) noexcept;
/// The table's objection to this step; empty: none.
[[nodiscard]] std::string wrong_step(InstancePhase from, InstancePhase to, InstanceState shown);

}  // namespace plchost
