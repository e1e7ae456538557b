#include "manager/supervisor/instance_phase.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

namespace plchost {

namespace {

constexpr auto kPhaseSteps = [] {
  using enum InstancePhase;
  return std::array{
      std::pair{down, held},
      std::pair{down, backing_off},
      std::pair{down, setting_up},
      std::pair{down, adopting},
      std::pair{down, ending},
      std::pair{held, down},
      std::pair{held, backing_off},
      std::pair{held, setting_up},
      std::pair{backing_off, down},
      std::pair{backing_off, setting_up},
      std::pair{backing_off, adopting},
      std::pair{backing_off, ending},
      std::pair{setting_up, down},
      std::pair{setting_up, backing_off},
      std::pair{setting_up, up},
      std::pair{setting_up, ending},
      std::pair{adopting, down},
      std::pair{adopting, backing_off},
      std::pair{adopting, setting_up},
      std::pair{adopting, up},
      std::pair{adopting, ending},
      std::pair{up, down},
      std::pair{up, backing_off},
      std::pair{up, ending},
      std::pair{ending, down},
      std::pair{ending, backing_off},
      std::pair{ending, setting_up},
  };
}();

constexpr auto kShownStates = [] {
  using enum InstancePhase;
  return std::array{
      std::pair{down, InstanceState::offline},        std::pair{down, InstanceState::failed},
      std::pair{held, InstanceState::waiting},        std::pair{backing_off, InstanceState::waiting},
      std::pair{setting_up, InstanceState::starting}, std::pair{adopting, InstanceState::starting},
      std::pair{up, InstanceState::running},          std::pair{up, InstanceState::stopped},
      std::pair{up, InstanceState::stopping},         std::pair{up, InstanceState::exception},
      std::pair{up, InstanceState::safe_mode},        std::pair{ending, InstanceState::stopping},
  };
}();

}  // namespace

std::string_view to_string(InstancePhase phase) noexcept {
  switch (phase) {
    case InstancePhase::down:
      return "down";
    case InstancePhase::held:
      return "held";
    case InstancePhase::backing_off:
      return "backing off";
    case InstancePhase::setting_up:
      return "setting up";
    case InstancePhase::adopting:
      return "adopting";
    case InstancePhase::up:
      return "up";
    case InstancePhase::ending:
      return "ending";
  }
  return "unknown";
}

bool leads(InstancePhase from, InstancePhase to) noexcept {
  return from == to || std::ranges::find(kPhaseSteps, std::pair(from, to)) != kPhaseSteps.end();
}

bool shows(InstancePhase phase, InstanceState state) noexcept {
  return std::ranges::find(kShownStates, std::pair(phase, state)) != kShownStates.end();
}

std::string wrong_step(InstancePhase from, InstancePhase to, InstanceState shown) {
  if (!leads(from, to)) return fmt::format("'{}' does not lead to '{}'", to_string(from), to_string(to));
  if (!shows(to, shown)) return fmt::format("'{}' is not shown as {}", to_string(to), to_string(shown));
  return "";
}

}  // namespace plchost
