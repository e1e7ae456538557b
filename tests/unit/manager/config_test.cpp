#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "manager/config/config_table.hpp"
#include "manager/config/load_config.hpp"
#include "shm/pages/host_page.hpp"
#include "shm/toml/toml_document.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

ConfigSurroundings four_cores() {
  return {.host_name = "cell9",
          .online_cores = {0, 1, 2, 3},
          .isolated_cores = {},
          .schedulers = {"CmpSchedule", "CmpScheduleTimer", "CmpScheduleOneShot"},
          .check_files = false,
          .check_directories = false,
          .interfaces = {},
          .check_application = nullptr,
          .check_settings = nullptr};
}

auto parse(std::string_view text, const ConfigSurroundings& surroundings = four_cores()) {
  return parse_config(text, "/etc/plchost/cell.toml", surroundings);
}

TEST(Config, TakesDefaultsFromTheSystem) {
  const auto sut = parse("");
  ASSERT_TRUE(sut.has_value());
  EXPECT_EQ(sut->host.name, "cell9");
  EXPECT_EQ(sut->host.run_directory, "/run/plchost");
  EXPECT_THAT(sut->host.cores, ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(sut->host.housekeeping_cores, ElementsAre(0, 1, 2, 3));
  EXPECT_TRUE(sut->dds.enabled);
  EXPECT_TRUE(sut->instances.empty());
}

TEST(Config, WithAnIdentityOrIfToldSoTheApiMayBeOnANetwork) {
  const auto secured = parse("[dds]\ninterface = \"eth0\"\nidentity = \"security/host\"\n");
  ASSERT_TRUE(secured.has_value());
  EXPECT_EQ(secured->dds.identity, "/etc/plchost/security/host");
  const auto open = parse("[dds]\ninterface = \"eth0\"\nallow_unsecured = true\n");
  ASSERT_TRUE(open.has_value());
  EXPECT_TRUE(open->dds.allow_unsecured);
}

TEST(Config, PrefersTheIsolatedCoresAndKeepsHouseOnTheOthers) {
  auto surroundings = four_cores();
  surroundings.isolated_cores = {2, 3};
  const auto sut = parse("", surroundings);
  ASSERT_TRUE(sut.has_value());
  EXPECT_THAT(sut->host.cores, ElementsAre(2, 3));
  EXPECT_THAT(sut->host.housekeeping_cores, ElementsAre(0, 1));
}

TEST(Config, ReadsEveryKey) {
  const auto sut = parse(R"(
[host]
name = "cell1"
dds_domain = 7
run_directory = "/tmp/cell1"
pool = "cell1"
pool_objects = 128
application_limit_mib = 8
application_versions = 9
pool_owner = "root"
pool_group = "1000"
pool_mode = "0640"
cores = [1, 2]
housekeeping_cores = [0]
log_level = "debug"
keep_pool = true
[dds]
enabled = false
interface = "eth0"
peers = ["10.0.0.2", "cell2:7410"]
[[instance]]
name = "drive1"
core = 2
[[instance]]
name = "line1"
core = 1
scheduler = "CmpScheduleTimer"
priority_band = "high"
settings = "line1.cfg"
application = "/opt/line.so"
autostart = false
after = ["drive1"]
restart = "always"
restart_delay_ms = 10
restart_delay_max_ms = 20
crash_limit = 3
crash_window_s = 5
share_core = true
)");
  ASSERT_TRUE(sut.has_value());
  EXPECT_EQ(sut->host.dds_domain, 7);
  EXPECT_EQ(sut->host.pool_objects, 128U);
  EXPECT_EQ(sut->host.application_limit_mib, 8U);
  EXPECT_EQ(sut->host.application_versions, 9U);
  EXPECT_EQ(sut->host.pool_owner, "root");
  EXPECT_EQ(sut->host.pool_group, "1000");
  EXPECT_EQ(sut->host.pool_mode, 0640U);
  EXPECT_TRUE(sut->host.keep_pool);
  EXPECT_FALSE(sut->dds.enabled);
  EXPECT_THAT(sut->dds.peers, ElementsAre("10.0.0.2", "cell2:7410"));
  const InstanceConfig& line = sut->instances.at(1);
  EXPECT_EQ(line.core, 1);
  EXPECT_EQ(line.scheduler, "CmpScheduleTimer");
  EXPECT_EQ(line.priority_band, "high");
  EXPECT_EQ(line.settings, "/etc/plchost/line1.cfg");
  EXPECT_EQ(line.application, "/opt/line.so");
  EXPECT_FALSE(line.autostart);
  EXPECT_THAT(line.after, ElementsAre("drive1"));
  EXPECT_EQ(line.restart, RestartPolicy::always);
  EXPECT_EQ(line.restart_delay, std::chrono::milliseconds(10));
  EXPECT_EQ(line.restart_delay_max, std::chrono::milliseconds(20));
  EXPECT_EQ(line.crash_limit, 3U);
  EXPECT_EQ(line.crash_window, std::chrono::seconds(5));
}

struct WrongConfig {
  const char* name;
  std::string text;
  std::string where;  ///< the line
  std::string what;   ///< part of the message: key, value and what is allowed
};

class ConfigRefuses : public testing::TestWithParam<WrongConfig> {};

TEST_P(ConfigRefuses, WithLineKeyValueAndWhatIsAllowed) {
  const auto sut = parse(GetParam().text);
  ASSERT_FALSE(sut.has_value());
  EXPECT_THAT(sut.error(), ElementsAre(testing::AllOf(
                               testing::StartsWith("/etc/plchost/cell.toml:" + GetParam().where + ": "),
                               HasSubstr(GetParam().what))));
}

std::string instance(std::string_view keys, std::string_view name = "a", int core = 1) {
  return fmt::format("[[instance]]\nname = \"{}\"\ncore = {}\n{}\n", name, core, keys);
}

INSTANTIATE_TEST_SUITE_P(
    Host, ConfigRefuses,
    testing::Values(
        WrongConfig{"syntax", "[host]\nname = \n", "2:8", "the value of name is missing"},
        WrongConfig{"section", "[hots]\n", "1",
                    "unknown section or key 'hots'; allowed are [host], [dds], "
                    "[blocks], [[instance]]; did you mean 'host'?"},
        WrongConfig{"section_type", "host = 1\n", "1", "'host' must be a section: [host]"},
        WrongConfig{"key", "[host]\nnmae = \"x\"\n", "2", "[host] unknown key 'nmae'; allowed are name, "},
        WrongConfig{"suggestion", "[host]\nnmae = \"x\"\n", "2", "did you mean 'name'?"},
        WrongConfig{"name", "[host]\nname = \"a b\"\n", "2",
                    "[host] name: name 'a b' is not valid: allowed are 1 to 63"},
        WrongConfig{"name_type", "[host]\nname = 5\n", "2",
                    "[host] name: 5 is a whole number; allowed is a text"},
        WrongConfig{"name_all", "[host]\nname = \"all\"\n", "2", "'all' stands for all hosts"},
        WrongConfig{"fraction", "[host]\ndds_domain = 1.0\n", "2",
                    "1.0 is a fraction; allowed is a whole number"},
        WrongConfig{"domain", "[host]\n\ndds_domain = 233\n", "3",
                    "dds_domain: 233 is out of range; allowed is 0 to 230"},
        WrongConfig{"domain_low", "[host]\ndds_domain = -1\n", "2", "dds_domain: -1 is out of range"},
        WrongConfig{"domain_type", "[host]\ndds_domain = \"1\"\n", "2",
                    "allowed is a whole number from 0 to 230"},
        WrongConfig{"run", "[host]\nrun_directory = \"run\"\n", "2",
                    "\"run\" is not allowed; allowed is an absolute path"},
        WrongConfig{"run_empty", "[host]\nrun_directory = \"\"\n", "2",
                    "\"\" is not allowed; allowed is an absolute path"},
        WrongConfig{"groups", "[host]\ninstance_groups = \"plc\"\n", "2",
                    "\"plc\" is not allowed; allowed is an absolute path"},
        WrongConfig{"run_long", "[host]\nrun_directory = \"/" + std::string(70, 'x') + "\"\n", "2",
                    "of up to 70 characters"},
        WrongConfig{"pool", "[host]\npool = \"a/b\"\n", "2", "'a/b' is not valid"},
        WrongConfig{"limit", "[host]\napplication_limit_mib = 0\n", "2", "allowed is 1 to 1024"},
        WrongConfig{"versions", "[host]\napplication_versions = 101\n", "2", "allowed is 1 to 100"},
        WrongConfig{"objects", "[host]\npool_objects = 15\n", "2", "allowed is 16 to 1000000"},
        WrongConfig{"objects_high", "[host]\npool_objects = 1000001\n", "2", "allowed is 16 to 1000000"},
        WrongConfig{"cores_type", "[host]\ncores = 1\n", "2", "allowed is an array of whole numbers"},
        WrongConfig{"cores_element", "[host]\ncores = [\"1\"]\n", "2",
                    "allowed is an array of whole numbers"},
        WrongConfig{"cores_offline", "[host]\ncores = [9]\n", "2",
                    "core 9 is not online; online are 0, 1, 2, 3"},
        WrongConfig{"cores_empty", "[host]\ncores = []\n", "2", "is empty; online are 0, 1, 2, 3"},
        WrongConfig{"house", "[host]\nhousekeeping_cores = [8]\n", "2",
                    "housekeeping_cores: core 8 is not online"},
        WrongConfig{
            "level", "[host]\nlog_level = \"inof\"\n", "2",
            "\"inof\" is not known; allowed are trace, debug, info, warning, error; did you mean 'info'?"},
        WrongConfig{
            "owner", "[host]\npool_owner = \"nobody here\"\n", "2",
            "pool_owner: there is no user \"nobody here\" on this host; allowed is a user's name or number"},
        WrongConfig{"owner_type", "[host]\npool_owner = 0\n", "2", "0 is a whole number; allowed is a text"},
        WrongConfig{"owner_high", "[host]\npool_owner = \"4294967295\"\n", "2", "there is no user"},
        WrongConfig{"group", "[host]\npool_group = \"nobody here\"\n", "2",
                    "there is no group \"nobody here\""},
        WrongConfig{"mode_execute", "[host]\npool_mode = \"0770\"\n", "2", "\"0770\" is not allowed"},
        WrongConfig{"mode_owner", "[host]\npool_mode = \"0460\"\n", "2", "the owner reads and writes"},
        WrongConfig{"mode_text", "[host]\npool_mode = \"rw-rw----\"\n", "2", "\"rw-rw----\" is not allowed"},
        WrongConfig{"mode_digits", "[host]\npool_mode = \"00000660\"\n", "2", "\"00000660\" is not allowed"},
        WrongConfig{"mode_empty", "[host]\npool_mode = \"\"\n", "2", "\"\" is not allowed"},
        WrongConfig{"mode_type", "[host]\npool_mode = 660\n", "2",
                    "660 is a whole number; allowed is a text"},
        WrongConfig{"keep", "[host]\nkeep_pool = 1\n", "2", "1 is a whole number; allowed is true or false"},
        WrongConfig{"date", "[host]\nname = 1979-05-27\n", "2", "is a date or time; allowed is a text"},
        WrongConfig{
            "dds_key", "[dds]\nport = 1\n", "2",
            "[dds] unknown key 'port'; allowed are enabled, interface, peers, multicast, identity, user, "
            "allow_unsecured"},
        WrongConfig{"user_unknown", "[dds]\nuser = \"nobody here\"\n", "2",
                    "there is no user \"nobody here\""},
        WrongConfig{"user_root", "[dds]\nuser = \"root\"\n", "2", "root has all rights; name another user"},
        WrongConfig{"user_number", "[dds]\nuser = \"0\"\n", "2", "root has all rights; name another user"},
        WrongConfig{"instance_user_unknown", "[host]\ninstance_user = \"nobody here\"\n", "2",
                    "there is no user \"nobody here\""},
        WrongConfig{"instance_user_root", "[host]\ninstance_user = \"root\"\n", "2",
                    "root has all rights; name another user"},
        WrongConfig{"user_of_both", "[host]\ninstance_user = \"1\"\n[dds]\nuser = \"1\"\n", "4",
                    "user: is the user of instances, too"},
        WrongConfig{"user_of_gateway", "[blocks]\nhost_number = 1\n[dds]\nuser = \"nobody\"\n", "2",
                    "host_number: needs an API server with the manager's user"},
        WrongConfig{"interface", "[dds]\ninterface = \"\"\n", "2", "interface '' is not valid"},
        WrongConfig{"open_to_network", "[dds]\ninterface = \"eth0\"\n", "2",
                    "interface: \"eth0\" without an identity opens this controller to all who reach it"},
        WrongConfig{"identity_empty", "[dds]\nidentity = \"\"\n", "2", "identity: is no path"},
        WrongConfig{"identity_type", "[dds]\nidentity = true\n", "2", "allowed is a text in quotes"},
        WrongConfig{"peers", "[dds]\npeers = [\"-x\"]\n", "2", "\"-x\" is not an address"},
        WrongConfig{"peers_port", "[dds]\npeers = [\"10.0.0.1:99999\"]\n", "2",
                    "\"10.0.0.1:99999\" is not an address"},
        WrongConfig{"peers_no_port", "[dds]\npeers = [\"[fe80::1]:\"]\n", "2", "is not an address"},
        WrongConfig{"peers_type", "[dds]\npeers = [1]\n", "2", "allowed is an array of texts"}),
    [](const auto& test) { return test.param.name; });

TEST(ConfigDepth, IsBoundedBeforeAStackEnds) {
  std::string parts = "a";
  for (int i = 0; i < 100'000; ++i) parts += ".a";
  for (const std::string& deep : {"[" + parts + "]\n", parts + " = 1\n", "x = {" + parts + " = 1}\n"}) {
    const auto parsed = parse_toml("# one\n" + deep);
    ASSERT_FALSE(parsed);
    EXPECT_EQ(parsed.error().line, 2U);
    EXPECT_THAT(parsed.error().text, testing::HasSubstr("a key has more than 32 parts"));
  }
  const std::string dots(1000, '.');
  EXPECT_TRUE(parse_toml("a = \"" + dots + "\" # " + dots + "\nb = '" + dots + "'\nc = \"\"\"\n" + dots +
                         "\n\"\"\"\n"));
}

INSTANTIATE_TEST_SUITE_P(
    Syntax, ConfigRefuses,
    testing::Values(
        WrongConfig{"word", "[host]\nname = a\n", "2:8", "put texts in quotes: name = \"a\""},
        WrongConfig{"word_like_infinity", "[host]\nlog_level = info\n", "2:16", "log_level = \"info\""},
        WrongConfig{"path", "[host]\nrun_directory = /tmp/x # here\n", "2:17", "run_directory = \"/tmp/x\""},
        WrongConfig{"mode", "[host]\npool_mode = 0660\n", "2:17",
                    "the number 0660 begins with 0; put a mode in quotes (pool_mode = \"0660\")"},
        WrongConfig{"too_many_digits", "[host]\npool_objects = 99999999999999999999\n", "2:36",
                    "the number 99999999999999999999 of pool_objects does not fit into 64 bit"},
        WrongConfig{"truth", "[host]\nkeep_pool = True\n", "2:13", "keep_pool = true"},
        WrongConfig{"no", "[host]\nkeep_pool = no\n", "2:14", "keep_pool = false"},
        WrongConfig{"open_quote", "[host]\nname = \"a\n", "2:10", "the closing quote of name is missing"},
        WrongConfig{"backslash", "[host]\nname = \"C:\\x\"\n", "2:12", "name = 'C:\\x'"},
        WrongConfig{"behind", "[host]\nname = \"a\" b\n", "2:12", "'b' stands behind the value of name"},
        WrongConfig{"bracket", "[host\nname = \"a\"\n", "1:6", "the closing ] of '[host' is missing"},
        WrongConfig{"twice", "[host]\nname = \"a\"\nname = \"b\"\n", "3:8", "name is given twice"},
        WrongConfig{"no_equals", "[host]\nname \"a\"\n", "2:6", "a line is KEY = VALUE or [SECTION]"},
        WrongConfig{"list", "[host]\ncores = [0 1]\n", "2:12", "separate its values by commas"}),
    [](const auto& test) { return test.param.name; });

INSTANTIATE_TEST_SUITE_P(
    Blocks, ConfigRefuses,
    testing::Values(WrongConfig{"number", "[blocks]\nhost_number = 65535\n", "2", "0 to 65534"},
                    WrongConfig{"base", "[blocks]\nbase = \"a/b\"\n", "2", "name 'a/b' is not valid"},
                    WrongConfig{"key", "[blocks]\nnumber = 1\n", "2", "allowed are host_number, base"},
                    WrongConfig{"without_dds", "[dds]\nenabled = false\n[blocks]\nhost_number = 1\n", "4",
                                "needs [dds] enabled = true"},
                    WrongConfig{"taken_name",
                                "[blocks]\nhost_number = 1\n[[instance]]\nname = \"gateway\"\ncore = 1\n",
                                "4", "'gateway' is taken"}),
    [](const auto& test) { return test.param.name; });

INSTANTIATE_TEST_SUITE_P(
    Instance, ConfigRefuses,
    testing::Values(
        WrongConfig{"single_brackets", "[instance]\n", "1", "double brackets: [[instance]]"},
        WrongConfig{"no_name", "[[instance]]\ncore = 1\n", "1", "[[instance]] 'number 1' name: is missing"},
        WrongConfig{"no_core", "[[instance]]\nname = \"a\"\n", "1", "[[instance]] 'a' core: is missing"},
        WrongConfig{"name", instance("", "a/b"), "2", "'a/b' is not valid: allowed are 1 to 31"},
        WrongConfig{"name_long", instance("", std::string(32, 'n')), "2", "allowed are 1 to 31"},
        WrongConfig{"name_taken", instance("", "manager"), "2", "'manager' is taken"},
        WrongConfig{"twice", instance("") + instance("", "a", 2), "6", "name: is taken already in line 2"},
        WrongConfig{"offline", instance("", "a", 4), "3",
                    "core: core 4 is not online; online are 0, 1, 2, 3"},
        WrongConfig{"not_allowed", "[host]\ncores = [0]\n" + instance(""), "5",
                    "core 1 is not allowed; [host] cores allows 0"},
        WrongConfig{
            "scheduler", instance("scheduler = \"CmpSchedul\""), "4",
            "\"CmpSchedul\" is not known; allowed are CmpSchedule, CmpScheduleTimer, CmpScheduleOneShot; did "
            "you mean 'CmpSchedule'?"},
        WrongConfig{"band", instance("priority_band = \"top\""), "4", "allowed are high, normal, low"},
        WrongConfig{"settings", instance("settings = \"\""), "4", "settings: is no path"},
        WrongConfig{"path_long", instance("application = \"" + std::string(300, 'x') + "\""), "4",
                    "allowed are up to 255"},
        WrongConfig{"autostart", instance("autostart = \"yes\""), "4",
                    "\"yes\" is a text; allowed is true or false"},
        WrongConfig{"after_itself", instance("after = [\"a\"]"), "4", "it cannot come after itself"},
        WrongConfig{"after_nobody", instance("after = [\"drve1\"]") + instance("", "drive1", 2), "4",
                    "there is no instance 'drve1'; there are a, drive1; did you mean 'drive1'?"},
        WrongConfig{"circle", instance("after = [\"b\"]") + instance("after = [\"a\"]", "b", 2), "4",
                    "goes in a circle: a after b after a"},
        WrongConfig{"restart", instance("restart = \"onfailure\""), "4",
                    "allowed are never, on-failure, always; did you mean 'on-failure'?"},
        WrongConfig{"delay", instance("restart_delay_ms = 3600001"), "4", "allowed is 0 to 3600000"},
        WrongConfig{"delay_max", instance("restart_delay_max_ms = 99"), "4",
                    "99 is below restart_delay_ms, which is 100"},
        WrongConfig{"limit", instance("crash_limit = 0"), "4", "allowed is 1 to 100"},
        WrongConfig{"window", instance("crash_window_s = 0"), "4", "allowed is 1 to 86400"},
        WrongConfig{"key", instance("prioritiy_band = \"low\""), "4", "did you mean 'priority_band'?"}),
    [](const auto& test) { return test.param.name; });

TEST(Config, ReportsAllErrorsInTheOrderOfTheirLines) {
  const auto sut = parse("[host]\npool_objects = 1\nnmae = 1\n" + instance("core_ = 1", "a", 9));
  ASSERT_FALSE(sut.has_value());
  EXPECT_THAT(sut.error(), ElementsAre(HasSubstr("toml:2: "), HasSubstr("toml:3: "), HasSubstr("toml:6: "),
                                       HasSubstr("toml:7: ")));
}

TEST(Config, ReadsTheNumberOfTheHostForBlocks) {
  EXPECT_EQ(parse("")->blocks.host_number, 0);
  EXPECT_EQ(parse("")->blocks.base, "blocks");
  const auto sut = parse("[blocks]\nhost_number = 65534\nbase = \"line\"\n");
  ASSERT_TRUE(sut.has_value());
  EXPECT_EQ(sut->blocks.host_number, 65534);
  EXPECT_EQ(sut->blocks.base, "line");
}

TEST(Config, RefusesASharedCoreUnlessAllSayIt) {
  const auto neither = parse(instance("", "a") + instance("", "b"));
  ASSERT_FALSE(neither.has_value());
  EXPECT_THAT(neither.error(),
              ElementsAre(HasSubstr("core 1 is also used by 'b'"), HasSubstr("used by 'a'")));
  const auto one = parse(instance("share_core = true", "a") + instance("", "b"));
  ASSERT_FALSE(one.has_value());
  EXPECT_THAT(one.error(), ElementsAre(HasSubstr("'b' core: core 1 is also used by 'a'")));
  EXPECT_TRUE(parse(instance("share_core = true", "a") + instance("share_core = true", "b")).has_value());
}

std::string many_instances(std::uint32_t count) {
  std::string text;
  for (std::uint32_t i = 0; i < count; ++i) text += instance("share_core = true", fmt::format("i{}", i));
  return text;
}

TEST(Config, TakesAsManyInstancesAsTheHostPageHas) {
  EXPECT_TRUE(parse(many_instances(kMaxInstances)).has_value());
  const auto more = parse(many_instances(kMaxInstances + 1));
  ASSERT_FALSE(more.has_value());
  EXPECT_THAT(more.error(), ElementsAre(HasSubstr("65 instances; allowed are up to 64")));
}

TEST(Config, SaysOnceThatThereAreNoCores) {
  const auto sut = parse("[host]\ncores = []\n" + instance(""));
  ASSERT_FALSE(sut.has_value());
  EXPECT_THAT(sut.error(), ElementsAre(HasSubstr("cores: is empty; online are 0, 1, 2, 3")));
}

TEST(Config, ListsTheInterfacesThatThereAre) {
  auto surroundings = four_cores();
  surroundings.interfaces = {"lo", "eth0"};
  const std::string open = "\nallow_unsecured = true\n";
  EXPECT_TRUE(parse("[dds]\ninterface = \"eth0\"" + open, surroundings).has_value());
  const auto sut = parse("[dds]\ninterface = \"eth1\"" + open, surroundings);
  ASSERT_FALSE(sut.has_value());
  EXPECT_THAT(sut.error(),
              ElementsAre(HasSubstr("cell.toml:2: [dds] interface: there is no interface 'eth1'; "
                                    "there are lo, eth0; did you mean 'eth0'?")));
  EXPECT_TRUE(parse("[dds]\nenabled = false\ninterface = \"eth1\"" + open, surroundings).has_value());
}

TEST(Config, ChecksTheFoldersThatAStartMakes) {
  auto surroundings = four_cores();
  surroundings.check_directories = true;
  EXPECT_TRUE(
      parse("[host]\nrun_directory = \"/tmp/there/is/none\"\nstate_directory = \"/tmp\"\n", surroundings)
          .has_value());
  const auto sut = parse("[host]\nrun_directory = \"/etc/hostname/run\"\nstate_directory = \"/dev/null/x\"\n",
                         surroundings);
  ASSERT_FALSE(sut.has_value());
  EXPECT_THAT(sut.error(), ElementsAre(HasSubstr(":2: [host] run_directory: /etc/hostname is not a folder"),
                                       HasSubstr(":3: [host] state_directory: /dev/null is not a folder")));
  const auto shown =
      parse("[host]\nrun_directory = \"/proc/x\"\nstate_directory = \"/sys/y/z\"\n", surroundings);
  ASSERT_FALSE(shown.has_value());
  EXPECT_THAT(
      shown.error(),
      ElementsAre(HasSubstr(":2: [host] run_directory: /proc holds only what the kernel shows there"),
                  HasSubstr(":3: [host] state_directory: /sys holds only what the kernel shows there")));
}

TEST(Config, SaysWhichFileIsMissing) {
  auto surroundings = four_cores();
  surroundings.check_files = true;
  const auto sut = parse(instance("settings = \"x.cfg\"\napplication = \"/\""), surroundings);
  ASSERT_FALSE(sut.has_value());
  EXPECT_THAT(sut.error(), ElementsAre(HasSubstr("settings: there is no file /etc/plchost/x.cfg"),
                                       HasSubstr("application: / is not a file")));
}

TEST(Config, RefusesAFileThatIsMissingOrTooLarge) {
  const auto path = own_path("config.toml");
  const auto missing = load_config(path.string(), four_cores());
  ASSERT_FALSE(missing.has_value());
  EXPECT_THAT(missing.error(), ElementsAre(HasSubstr("there is no file")));
  std::ofstream(path) << std::string(kMaxConfigBytes, '\n');
  EXPECT_TRUE(load_config(path.string(), four_cores()).has_value());
  std::ofstream(path) << std::string(kMaxConfigBytes + 1, '\n');
  const auto large = load_config(path.string(), four_cores());
  ASSERT_FALSE(large.has_value());
  EXPECT_THAT(large.error(), ElementsAre(HasSubstr("is larger than the 1048576 bytes")));
  std::filesystem::remove(path);
}

// So does tests/gates/documents.py, which knows names and meanings only.
TEST(Config, IsDescribedByTheTableInItsDocument) {
  constexpr std::string_view kBegin = "<!-- generated: configuration, by unit_manager -->\n";
  constexpr std::string_view kEnd = "<!-- end of generated -->";
  const std::string table = config_key_table();
  std::stringstream stream;
  stream << std::ifstream(MANAGER_CONFIGURATION).rdbuf();
  std::string page = stream.str();
  const std::size_t begin = page.find(kBegin);
  ASSERT_NE(begin, std::string::npos) << MANAGER_CONFIGURATION " has no line " << kBegin;
  const std::size_t size = page.find(kEnd, begin) - begin - kBegin.size();
  ASSERT_LT(size, page.size()) << MANAGER_CONFIGURATION " has no line " << kEnd;
  if (std::getenv("PLCHOST_WRITE_TABLES") != nullptr) {
    std::ofstream(MANAGER_CONFIGURATION) << page.replace(begin + kBegin.size(), size, table);
    return;
  }
  EXPECT_EQ(page.substr(begin + kBegin.size(), size), table) << "write it: PLCHOST_WRITE_TABLES=1";
}

TEST(Config, RefusesAFileThatTheDiskDoesNotGive) {
  const auto sut = load_config("/proc/self/mem", four_cores());  // its first page is never mapped
  ASSERT_FALSE(sut.has_value());
  EXPECT_THAT(sut.error(), ElementsAre(HasSubstr("/proc/self/mem: cannot be read: Input/output error")));
}

}  // namespace
}  // namespace plchost
