#include "manager/supervisor/instance_phase.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

namespace plchost {

namespace {

constexpr auto kPhaseSteps = [] {
  using enum InstancePhase;
  // clang-format off
  return std::to_array<PhaseStep>({
      {down,        held,        "it is to start in the order of `after`"},
      {down,        backing_off, "its process ended unwatched, may still come up, or cannot be made"},
      {down,        setting_up,  "an operator starts it"},
      {down,        adopting,    "a process has outlived its manager"},
      {down,        ending,      "a process has outlived its manager, which had asked it to end"},
      {held,        down,        "it is stopped or removed, or cannot be started, or its manager ends"},
      {held,        backing_off, "its process cannot be made yet"},
      {held,        setting_up,  "the instances of `after` are up, or an operator starts it"},
      {backing_off, down,        "it is stopped, removed or given up, or its manager ends"},
      {backing_off, setting_up,  "the time is over, or an operator starts it"},
      {backing_off, adopting,    "a process of its name is there"},
      {setting_up,  down,        "its process has ended, and no other is to start"},
      {setting_up,  backing_off, "its process has ended, and another is to start"},
      {setting_up,  up,          "its process reports that it is ready, or a fault keeps it from that"},
      {setting_up,  ending,      "its process is replaced, it is removed, or its manager ends"},
      {adopting,    down,        "its process has ended, and no other is to start"},
      {adopting,    backing_off, "its process has ended, and another is to start"},
      {adopting,    setting_up,  "its process has ended in a load, and the application before starts"},
      {adopting,    up,          "its process answers, or the limit is over"},
      {adopting,    ending,      "its process is replaced, it is removed, or its manager ends"},
      {up,          down,        "its process has ended, and no other is to start"},
      {up,          backing_off, "its process has ended, and another is to start"},
      {up,          ending,      "its process is replaced, it is removed, or its manager ends"},
      {ending,      down,        "its process has ended, and no other is to start"},
      {ending,      backing_off, "its process has ended, and the next one cannot be made yet"},
      {ending,      setting_up,  "its process has ended, and the next one starts"},
  });
  // clang-format on
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

std::span<const PhaseStep> phase_steps() noexcept {
  return kPhaseSteps;
}

bool leads(InstancePhase from, InstancePhase to) noexcept {
  const auto is_it = [&](const PhaseStep& step) { return step.from == from && step.to == to; };
  return from == to || std::ranges::any_of(kPhaseSteps, is_it);
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
