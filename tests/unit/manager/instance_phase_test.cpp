// The table of the steps from one phase of an instance to another: rules that hold for any such table.
#include "manager/supervisor/instance_phase.hpp"

#include <cstddef>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace plchost {
namespace {

// Those that have a name.
const std::vector<InstancePhase>& all_phases() {
  static const std::vector<InstancePhase> all = [] {
    std::vector<InstancePhase> named;
    for (std::uint8_t i = 0; to_string(static_cast<InstancePhase>(i)) != "unknown"; ++i)
      named.push_back(static_cast<InstancePhase>(i));
    return named;
  }();
  return all;
}

// By any number of steps.
std::set<InstancePhase> reached_from(InstancePhase begin) {
  std::set<InstancePhase> reached{begin};
  for (std::size_t before = 0; before != reached.size();) {
    before = reached.size();
    for (const PhaseStep& step : phase_steps()) {
      if (reached.contains(step.from)) reached.insert(step.to);
    }
  }
  return reached;
}

TEST(InstancePhase, IsReachedFromDownAndLeadsBackThere) {
  for (const InstancePhase phase : all_phases()) {
    EXPECT_TRUE(reached_from(InstancePhase::down).contains(phase)) << to_string(phase);
    EXPECT_TRUE(reached_from(phase).contains(InstancePhase::down)) << to_string(phase);
  }
}

TEST(InstancePhase, HasEachStepOnceAndWithItsTrigger) {
  std::set<std::pair<InstancePhase, InstancePhase>> known;
  for (const PhaseStep& step : phase_steps()) {
    SCOPED_TRACE(fmt::format("from {} to {}", to_string(step.from), to_string(step.to)));
    EXPECT_FALSE(step.trigger.empty());
    EXPECT_NE(step.from, step.to);
    EXPECT_TRUE(known.emplace(step.from, step.to).second);
    EXPECT_TRUE(leads(step.from, step.to));
  }
}

// No instance is up that was neither set up nor adopted, and none loses its process without a decision.
TEST(InstancePhase, LeadsToAProcessOnlyByMakingOrFindingOne) {
  using enum InstancePhase;
  const auto has_process = [](InstancePhase phase) { return phase >= setting_up; };
  for (const InstancePhase from : all_phases()) {
    EXPECT_EQ(leads(from, up), from == setting_up || from == adopting || from == up) << to_string(from);
    EXPECT_EQ(leads(from, held), from == down || from == held) << to_string(from);
    if (has_process(from)) {
      EXPECT_TRUE(leads(from, down) && leads(from, backing_off)) << to_string(from);
    }
  }
}

TEST(InstancePhase, IsShownInSomeStateAndEachStateInSomePhase) {
  std::set<InstancePhase> phases;
  std::set<InstanceState> states;
  for (const InstancePhase phase : all_phases()) {
    for (std::uint32_t i = 0; i <= std::to_underlying(InstanceState::exception); ++i) {
      const auto state = static_cast<InstanceState>(i);
      if (!shows(phase, state)) continue;
      phases.insert(phase);
      states.insert(state);
    }
  }
  EXPECT_EQ(phases.size(), all_phases().size());
  EXPECT_EQ(states.size(), std::to_underlying(InstanceState::exception) + std::size_t{1});
}

TEST(InstancePhase, SaysWhatIsWrongWithAStep) {
  using enum InstancePhase;
  EXPECT_EQ(wrong_step(held, up, InstanceState::running), "'held' does not lead to 'up'");
  EXPECT_EQ(wrong_step(setting_up, up, InstanceState::offline), "'up' is not shown as offline");
  EXPECT_EQ(wrong_step(setting_up, up, InstanceState::running), "");
}

}  // namespace
}  // namespace plchost
