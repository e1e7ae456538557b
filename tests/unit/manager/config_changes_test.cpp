#include "manager/config/config_changes.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "manager/config/load_config.hpp"
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
  EXPECT_THAT(keys(changes, TakesEffect::next_start), ElementsAre("autostart"));
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
  EXPECT_THAT(keys(changes, TakesEffect::next_manager), ElementsAre("[host] pool"));
  EXPECT_THAT(keys(changes, TakesEffect::new_server),
              ElementsAre("[host] log_level", "[dds] interface", "[blocks] host_number"));
}

/// A key with two values that a file may give it.
struct TwoValues {
  std::string_view section;
  std::string_view name;
  std::string_view before;
  std::string_view now;
};

constexpr std::array kTwoValues = {
    TwoValues{"[host]", "name", R"("cell1")", R"("cell2")"},
    TwoValues{"[host]", "labels", R"(["a"])", R"(["b"])"},
    TwoValues{"[host]", "dds_domain", "1", "2"},
    TwoValues{"[host]", "run_directory", R"("/run/a")", R"("/run/b")"},
    TwoValues{"[host]", "state_directory", R"("/var/a")", R"("/var/b")"},
    TwoValues{"[host]", "application_limit_mib", "64", "65"},
    TwoValues{"[host]", "application_versions", "5", "6"},
    TwoValues{"[host]", "pool", R"("a")", R"("b")"},
    TwoValues{"[host]", "pool_objects", "100", "200"},
    TwoValues{"[host]", "pool_across_containers", "false", "true"},
    TwoValues{"[host]", "pool_owner", R"("0")", R"("1")"},
    TwoValues{"[host]", "pool_group", R"("0")", R"("1")"},
    TwoValues{"[host]", "pool_mode", R"("0660")", R"("0600")"},
    TwoValues{"[host]", "instance_user", R"("1")", R"("65534")"},
    TwoValues{"[host]", "instance_groups", R"("/sys/fs/cgroup/a")", R"("/sys/fs/cgroup/b")"},
    TwoValues{"[host]", "cores", "[0, 1]", "[0, 1, 2]"},
    TwoValues{"[host]", "housekeeping_cores", "[0]", "[1]"},
    TwoValues{"[host]", "read_variables", R"("viewer")", R"("operator")"},
    TwoValues{"[host]", "write_variables", R"("operator")", R"("engineer")"},
    TwoValues{"[host]", "log_level", R"("info")", R"("debug")"},
    TwoValues{"[host]", "allow_debug", "true", "false"},
    TwoValues{"[host]", "keep_pool", "false", "true"},
    TwoValues{"[dds]", "enabled", "true", "false"},
    TwoValues{"[dds]", "interface", R"("lo")", R"("eth1")"},
    TwoValues{"[dds]", "peers", "[]", R"(["10.0.0.1"])"},
    TwoValues{"[dds]", "multicast", "true", "false"},
    TwoValues{"[dds]", "identity", R"("/a")", R"("/b")"},
    TwoValues{"[dds]", "user", R"("1")", R"("65534")"},
    TwoValues{"[dds]", "allow_unsecured", "true", "false"},
    TwoValues{"[blocks]", "host_number", "1", "2"},
    TwoValues{"[blocks]", "base", R"("blocks")", R"("other")"},
    TwoValues{"[[instance]]", "name", R"("line1")", R"("line9")"},
    TwoValues{"[[instance]]", "core", "1", "2"},
    TwoValues{"[[instance]]", "share_core", "false", "true"},
    TwoValues{"[[instance]]", "scheduler", R"("CmpSchedule")", R"("CmpScheduleTimer")"},
    TwoValues{"[[instance]]", "priority_band", R"("normal")", R"("low")"},
    TwoValues{"[[instance]]", "memory_max_mib", "64", "65"},
    TwoValues{"[[instance]]", "pids_max", "64", "65"},
    TwoValues{"[[instance]]", "oom_score", "-950", "0"},
    TwoValues{"[[instance]]", "settings", R"("a.cfg")", R"("b.cfg")"},
    TwoValues{"[[instance]]", "application", R"("a.so")", R"("b.so")"},
    TwoValues{"[[instance]]", "autostart", "true", "false"},
    TwoValues{"[[instance]]", "after", "[]", R"(["other"])"},
    TwoValues{"[[instance]]", "restart", R"("never")", R"("always")"},
    TwoValues{"[[instance]]", "restart_delay_ms", "100", "200"},
    TwoValues{"[[instance]]", "restart_delay_max_ms", "5000", "6000"},
    TwoValues{"[[instance]]", "crash_limit", "5", "6"},
    TwoValues{"[[instance]]", "crash_window_s", "60", "61"},
};

/// A file that gives the key that value; all that it needs besides is the same for both values.
ManagerConfig file_with(const TwoValues& key, std::string_view value) {
  std::string text = fmt::format("{}\n{} = {}\n", key.section, key.name, value);
  if (key.section == "[host]" && key.name == "cores") text += "housekeeping_cores = [3]\n";
  if (key.section == "[dds]" && key.name == "interface") text += "allow_unsecured = true\n";
  if (key.section == "[[instance]]" && key.name != "name") text += "name = \"line1\"\n";
  if (key.section == "[[instance]]" && key.name != "core") text += "core = 1\n";
  text += "[[instance]]\nname = \"other\"\ncore = 0\n";
  auto config = parse_config(text, "/etc/plchost/cell.toml",
                             {.host_name = "cell",
                              .online_cores = {0, 1, 2, 3},
                              .isolated_cores = {},
                              .schedulers = {"CmpSchedule", "CmpScheduleTimer"},
                              .check_files = false});
  EXPECT_TRUE(config) << text << (config ? "" : config.error().front());
  return config ? *std::move(config) : ManagerConfig();
}

TEST(ConfigChanges, NameEachKeyOfTheFileAndNoOther) {
  std::vector<std::string> told;
  std::vector<std::string> keys;
  for (const TwoValues& key : kTwoValues) {
    const ManagerConfig before = file_with(key, key.before);
    const ManagerConfig now = file_with(key, key.now);
    const bool of_instance = key.section == "[[instance]]";
    const auto changes = of_instance ? changed_keys(before.instances.front(), now.instances.front())
                                     : changed_keys(before, now);
    const std::string name =
        of_instance ? std::string(key.name) : fmt::format("{} {}", key.section, key.name);
    EXPECT_THAT(changes, ElementsAre(testing::Field(&KeyChange::key, name)));
    told.push_back(fmt::format("{} {}", key.section, key.name));
  }
  for (const ConfigKey& key : all_config_keys()) keys.push_back(fmt::format("{} {}", key.section, key.name));
  EXPECT_EQ(told, keys) << "each key of the table has two values here";
}

TEST(ConfigChanges, AreTakenOverUnlessTheyWaitForAnotherManager) {
  for (const TwoValues& key : kTwoValues) {
    if (key.section == "[[instance]]") continue;
    ManagerConfig used = file_with(key, key.before);
    const ManagerConfig now = file_with(key, key.now);
    const KeyChange change = changed_keys(used, now).front();
    take_over(used, now);
    const auto left = changed_keys(used, now);
    EXPECT_EQ(left.size(), change.when == TakesEffect::next_manager ? 1U : 0U) << change.key;
  }
}

TEST(ConfigChanges, TheTableForPeopleHasEachKeyOnce) {
  std::string table;
  for (const std::string& row : key_table()) table += row + ", ";
  std::ranges::replace(table, ';', ',');
  for (const ConfigKey& key : all_config_keys()) {
    const std::string word = fmt::format(" {},", key.name);
    const std::string last = fmt::format(" {} |", key.name);
    EXPECT_TRUE(table.find(word) != std::string::npos || table.find(last) != std::string::npos) << key.name;
  }
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
