#include <algorithm>
#include <string>
#include <vector>

#include <control.h>
#include <gmock/gmock.h>

#include "api/cli/plant/plant_changes.hpp"
#include "api/cli/plant/plant_file.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

constexpr const char* kPlant = R"([[host]]
name = "cell1"
[[host.instance]]
name = "line1"
scheduler = "CmpScheduleTimer"
application = "/opt/plant/packer.so"
state = "running"
events = ["product", "stop"]
[[host.instance]]
name = "line2"
state = "stopped"

[[host]]
name = "cell2"
)";

TEST(PlantFile, SaysWhatEachInstanceIsToBe) {
  const auto plant = parse_plant(kPlant, "plant.toml");
  ASSERT_TRUE(plant) << plant.error().front();
  ASSERT_EQ(plant->hosts.size(), 2U);
  const WantedHost& cell1 = plant->hosts.front();
  EXPECT_EQ(cell1.name, "cell1");
  ASSERT_EQ(cell1.instances.size(), 2U);
  const WantedInstance& line1 = cell1.instances.front();
  EXPECT_EQ(line1.name, "line1");
  EXPECT_EQ(line1.line, 3U);
  EXPECT_EQ(line1.scheduler, "CmpScheduleTimer");
  EXPECT_EQ(line1.application, "/opt/plant/packer.so");
  EXPECT_EQ(line1.running, true);
  EXPECT_THAT(line1.events, ElementsAre("product", "stop"));
  EXPECT_EQ(cell1.instances.back().running, false);
  EXPECT_EQ(plant->hosts.back().instances.size(), 0U);
}

struct BadPlant {
  const char* text;
  const char* said;
};

class PlantFileRefuses : public testing::TestWithParam<BadPlant> {};

TEST_P(PlantFileRefuses, WithFileAndLineAndWhatIsAllowed) {
  const auto plant = parse_plant(GetParam().text, "plant.toml");
  ASSERT_FALSE(plant);
  EXPECT_THAT(plant.error().front(), StartsWith("plant.toml:"));
  EXPECT_THAT(plant.error().front(), HasSubstr(GetParam().said));
}

INSTANTIATE_TEST_SUITE_P(
    All, PlantFileRefuses,
    testing::Values(
        BadPlant{"", "describes no [[host]]"}, BadPlant{"x = ", "plant.toml:1:5: the value of x is missing"},
        BadPlant{"hosts = 1", "unknown section or key 'hosts'; allowed is [[host]]; did you mean 'host'?"},
        BadPlant{"[host]\nname = \"a\"", "'host' must be written with double brackets: [[host]]"},
        BadPlant{"host = [1]", "double brackets"}, BadPlant{"[[host]]\n", "[[host]] name: is missing"},
        BadPlant{"[[host]]\nname = 1", "1 is a whole number; allowed is a text in quotes"},
        BadPlant{"[[host]]\nname = \"a b\"", "plant.toml:2: [[host]] 'a b' name:"},
        BadPlant{"[[host]]\nname = \"a\"\n[[host]]\nname = \"a\"",
                 "plant.toml:4: [[host]] 'a' name: 'a' is there twice"},
        BadPlant{"[[host]]\nname = \"a\"\nadress = 1", "unknown key 'adress'; allowed are name, instance"},
        BadPlant{"[[host]]\nname = \"a\"\ninstance = 1", "[[host.instance]]"},
        BadPlant{"[[host]]\nname = \"a\"\n[[host.instance]]\nstate = \"running\"", "name: is missing"},
        BadPlant{
            "[[host]]\nname = \"a\"\n[[host.instance]]\nname = \"i\"\nstate = \"runing\"",
            "plant.toml:5: [[host.instance]] of 'a' 'i' state: \"runing\" is not known; allowed are running, "
            "stopped; did you mean 'running'?"},
        BadPlant{
            "[[host]]\nname = \"a\"\n[[host.instance]]\nname = \"i\"\nshedule = \"x\"",
            "unknown key 'shedule'; allowed are name, scheduler, application, state, events; did you mean "
            "'scheduler'?"},
        BadPlant{"[[host]]\nname = \"a\"\n[[host.instance]]\nname = \"i\"\napplication = \"x.so\"",
                 "allowed is an absolute path on the host"},
        BadPlant{"[[host]]\nname = \"a\"\n[[host.instance]]\nname = \"i\"\nscheduler = \"\"", "scheduler"},
        BadPlant{"[[host]]\nname = \"a\"\n[[host.instance]]\nname = \"i\"\nscheduler = \"Cmp Schedule\"",
                 "'Cmp Schedule' is not valid"},
        BadPlant{"[[host]]\nname = \"a\"\n[[host.instance]]\nname = \"i\"\nevents = [\"e\", \"e\"]",
                 "'e' is there twice"},
        BadPlant{"[[host]]\nname = \"a\"\n[[host.instance]]\nname = \"i\"\nevents = \"e\"",
                 "an array of texts"},
        BadPlant{"[[host]]\nname = \"a\"\n[[host.instance]]\nname = \"i\"\n[[host.instance]]\nname = \"i\"",
                 "plant.toml:5: [[host.instance]] 'i' of host 'a' is there twice"}));

TEST(PlantFile, TellsAllErrorsAtOnce) {
  const auto plant = parse_plant("[[host]]\nname = 1\nx = 1\n[[host.instance]]\nstate = 3\n", "p");
  ASSERT_FALSE(plant);
  EXPECT_EQ(plant.error().size(), 4U);
}

TEST(PlantFile, ThatIsNotThereIsAnError) {
  const auto plant = load_plant("/nowhere/plant.toml");
  ASSERT_FALSE(plant);
  EXPECT_THAT(plant.error().front(), HasSubstr("/nowhere/plant.toml: No such file"));
}

TEST(PlantFile, HasABoundForHosts) {
  std::string text;
  for (std::size_t i = 0; i <= kMaxPlantHosts; ++i)
    text += "[[host]]\nname = \"h" + std::to_string(i) + "\"\n";
  const auto plant = parse_plant(text, "p");
  ASSERT_FALSE(plant);
  EXPECT_THAT(plant.error().front(), HasSubstr("1025 times [[host]]; allowed are up to 1024"));
}

constexpr std::uint32_t kOffline = 0;
constexpr std::uint32_t kRunning = 2;
constexpr std::uint32_t kStopped = 3;
constexpr std::uint32_t kSafeMode = 6;
constexpr std::uint32_t kException = 8;

WantedInstance wanted(bool running) {
  WantedInstance instance;
  instance.scheduler = "CmpSchedule";
  instance.application = "/a.so";
  instance.running = running;
  instance.events = {"e"};
  return instance;
}

PresentInstance present(std::uint32_t state) {
  return {.state = state, .scheduler = "CmpSchedule", .application = "/a.so", .events = {"e", "more"}};
}

std::vector<std::int32_t> operations(const WantedInstance& wanted, const PresentInstance& present) {
  std::vector<std::int32_t> operations;
  for (const PlantChange& change : changes_to(wanted, present)) operations.push_back(change.operation);
  return operations;
}

TEST(PlantChanges, AreNoneWhereAllIsAsItIsToBe) {
  EXPECT_THAT(operations(wanted(true), present(kRunning)), IsEmpty());
  EXPECT_THAT(operations(wanted(false), present(kStopped)), IsEmpty());
  EXPECT_THAT(operations(wanted(false), present(kOffline)), IsEmpty());
}

TEST(PlantChanges, AreNoneOfWhatTheFileDoesNotName) {
  EXPECT_THAT(operations(WantedInstance{}, present(kException)), IsEmpty());
}

TEST(PlantChanges, TellWhatIsAndWhatIsWanted) {
  auto is = present(kRunning);
  is.scheduler = "CmpScheduleTimer";
  const auto changes = changes_to(wanted(true), is);
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_EQ(changes[0].what, "scheduler");
  EXPECT_EQ(changes[0].is, "CmpScheduleTimer");
  EXPECT_EQ(changes[0].wanted, "CmpSchedule");
  EXPECT_EQ(changes[0].argument, "CmpSchedule");
}

TEST(PlantChanges, EndWithTheStart) {
  const PresentInstance is{.state = kStopped, .scheduler = "x", .application = "/b.so", .events = {}};
  EXPECT_THAT(operations(wanted(true), is),
              ElementsAre(plc_OPERATION_LOAD_APPLICATION, plc_OPERATION_SET_SCHEDULER,
                          plc_OPERATION_REGISTER_EVENT, plc_OPERATION_START));
}

TEST(PlantChanges, BeginWithTheStop) {
  const PresentInstance is{.state = kRunning, .scheduler = "x", .application = "/b.so", .events = {}};
  EXPECT_THAT(operations(wanted(false), is),
              ElementsAre(plc_OPERATION_STOP, plc_OPERATION_LOAD_APPLICATION, plc_OPERATION_SET_SCHEDULER,
                          plc_OPERATION_REGISTER_EVENT));
}

TEST(PlantChanges, MakeAProcessBeforeItsEventsAreRegistered) {
  auto is = present(kOffline);
  is.events.clear();
  EXPECT_THAT(operations(wanted(true), is), ElementsAre(plc_OPERATION_START, plc_OPERATION_REGISTER_EVENT));
}

TEST(PlantChanges, LeadOutOfFaults) {
  for (const std::uint32_t state : {kException, kSafeMode}) {
    EXPECT_THAT(operations(wanted(true), present(state)), ElementsAre(plc_OPERATION_RESTART)) << state;
    EXPECT_THAT(operations(wanted(false), present(state)), ElementsAre(plc_OPERATION_RESET)) << state;
    auto other = present(state);
    other.application = "/b.so";
    EXPECT_THAT(operations(wanted(true), other), ElementsAre(plc_OPERATION_LOAD_APPLICATION)) << state;
  }
}

}  // namespace
}  // namespace plchost
