#include "manager/config/config_changes.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "manager/control/config_reload.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

std::vector<std::string> keys(const std::vector<KeyChange>& changes, TakesEffect when) {
  std::vector<std::string> keys;
  for (const KeyChange& change : changes) {
    if (change.when == when) keys.push_back(change.key);
  }
  return keys;
}

TEST(ConfigChanges, NamesTheKeysOfAnInstanceByWhenTheyTakeEffect) {
  const InstanceConfig before;
  EXPECT_THAT(changed_keys(before, before), IsEmpty());
  InstanceConfig now;
  now.core = 3;
  now.settings = "/etc/line1.cfg";
  now.autostart = false;
  now.restart = RestartPolicy::always;
  now.after = {"drive1"};
  const auto changes = changed_keys(before, now);
  EXPECT_THAT(keys(changes, TakesEffect::next_process), ElementsAre("core", "settings"));
  EXPECT_THAT(keys(changes, TakesEffect::at_once), ElementsAre("after", "restart"));
  EXPECT_THAT(keys(changes, TakesEffect::next_manager), ElementsAre("autostart"));
}

TEST(ConfigChanges, NamesTheKeysOfTheHostWithTheirSections) {
  const ManagerConfig before;
  ManagerConfig now;
  now.host.pool = "other";
  now.host.log_level = "debug";
  now.dds.interface = "eth0";
  now.blocks.host_number = 7;
  now.instances.resize(1);  // not of the host
  const auto changes = changed_keys(before, now);
  EXPECT_THAT(keys(changes, TakesEffect::next_manager),
              ElementsAre("[host] pool", "[dds] interface", "[blocks] host_number"));
  EXPECT_THAT(keys(changes, TakesEffect::at_once), ElementsAre("[host] log_level"));
}

TEST(JoinLines, TellsHowManyItLeavesOut) {
  EXPECT_EQ(join_lines({}, "the log"), "");
  EXPECT_EQ(join_lines({"one", "two"}, "the log"), "one\ntwo");
  constexpr std::size_t kMost = 40;
  const std::vector<std::string> lines(10, "0123456789");
  EXPECT_EQ(join_lines(lines, "the log", kMost), "0123456789\nand 9 more: see the log");
  const std::string long_line(100, 'x');
  const std::string cut = join_lines({long_line, "two"}, "the log", kMost);
  EXPECT_LE(cut.size(), kMost);
  EXPECT_THAT(cut, StartsWith("xxx"));
  EXPECT_THAT(cut, HasSubstr("\nand 1 more: see the log"));
  EXPECT_EQ(join_lines({long_line}, "the log", kMost), std::string(kMost, 'x'));
}

}  // namespace
}  // namespace plchost
