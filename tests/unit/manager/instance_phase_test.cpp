// The ways from one phase of an instance to another, against the table in the header.
#include "manager/supervisor/instance_phase.hpp"

#include <array>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

namespace plchost {
namespace {

// clang-format off
constexpr std::array<std::string_view, kInstancePhases> kWanted = {
    // to: down, held, backing off, setting up, adopting, up, ending
    "yyyyy-y",  // from down
    "yyyy---",  // held
    "y-yyy-y",  // backing off
    "y-yy-yy",  // setting up
    "y-yyyyy",  // adopting
    "y-y--yy",  // up
    "y-yy--y",  // ending
};
// clang-format on

TEST(InstancePhase, LeadsToThoseThatTheTableHas) {
  for (std::uint8_t from = 0; from < kInstancePhases; ++from) {
    std::string row;
    for (std::uint8_t to = 0; to < kInstancePhases; ++to) {
      row += leads(static_cast<InstancePhase>(from), static_cast<InstancePhase>(to)) ? 'y' : '-';
    }
    EXPECT_EQ(row, kWanted.at(from)) << "from " << to_string(static_cast<InstancePhase>(from));
  }
}

TEST(InstancePhase, IsShownAsTheTableSays) {
  using enum InstancePhase;
  const auto states_of = [](InstancePhase phase) {
    std::string all;
    for (std::uint32_t state = 0; state <= static_cast<std::uint32_t>(InstanceState::exception); ++state) {
      if (!shows(phase, static_cast<InstanceState>(state))) continue;
      all += (all.empty() ? "" : ", ") + std::string(to_string(static_cast<InstanceState>(state)));
    }
    return all;
  };
  EXPECT_EQ(states_of(down), "offline, failed");
  EXPECT_EQ(states_of(held), "waiting");
  EXPECT_EQ(states_of(backing_off), "waiting");
  EXPECT_EQ(states_of(setting_up), "starting");
  EXPECT_EQ(states_of(adopting), "starting");
  EXPECT_EQ(states_of(up), "running, stopped, stopping, safe mode, exception");
  EXPECT_EQ(states_of(ending), "stopping");
}

TEST(InstancePhase, SaysWhatIsWrongWithAStep) {
  using enum InstancePhase;
  EXPECT_EQ(wrong_step(held, up, InstanceState::running), "'held' does not lead to 'up'");
  EXPECT_EQ(wrong_step(setting_up, up, InstanceState::offline), "'up' is not shown as offline");
  EXPECT_EQ(wrong_step(setting_up, up, InstanceState::running), "");
}

}  // namespace
}  // namespace plchost
