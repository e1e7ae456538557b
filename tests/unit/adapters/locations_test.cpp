#include "instances/adapters/iec/locations.hpp"

#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "instances/adapters/iec/task_file.hpp"
#include "instances/adapters/iec/task_plan.hpp"
#include "tests/unit/adapters/problem_texts.hpp"

namespace plchost::iec {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class PlacedLocations : public testing::Test {
 protected:
  // Each declaration stands in a line of its own, the first one in line 2.
  Locations of(const std::vector<std::string>& declarations, const std::string& task_file = "") {
    std::string text = "PROGRAM Main VAR\n";
    for (const std::string& declaration : declarations) text += declaration + ";\n";
    text +=
        "END_VAR END_PROGRAM CONFIGURATION cell RESOURCE press ON PLC TASK fast (INTERVAL := T#1s, PRIORITY "
        ":= 1); PROGRAM one WITH fast : Main; END_RESOURCE END_CONFIGURATION";
    const std::vector<Source> sources{{"a.st", text}};
    auto [read, problems] = read_project(sources);
    EXPECT_THAT(texts(problems), IsEmpty());
    project = std::move(read);
    EXPECT_THAT(texts(read_task_file({"a.toml", task_file}, project.configurations.at(0))), IsEmpty());
    return {project, project.configurations.at(0)};
  }
  // "4", "0.3" (byte and bit), or the error.
  static std::string at(const Locations& locations, const std::string& location) {
    const auto place = locations.place(location);
    if (!place) return place.error();
    return place->bit < 0 ? std::to_string(place->offset) : fmt::format("{}.{}", place->offset, place->bit);
  }
  Project project;
};

TEST_F(PlacedLocations, OfSeveralNumbersLieInTheirOrderBehindAllOthers) {
  const std::vector<std::string> declared{"last AT %IW0.2.1 : INT",     "direct AT %IW1 : INT",
                                          "bit AT %IX0.1.0.1 : BOOL",   "wide AT %ID0.1.7 : DINT",
                                          "other AT %IX0.1.0.0 : BOOL", "out AT %QW0.1.8192.0 : INT",
                                          "byte AT %IB0.10.0 : BYTE",   "long AT %QL0.2.0 : LINT"};
  for (const auto& order : {declared, std::vector(declared.rbegin(), declared.rend())}) {
    const Locations locations = of(order);
    EXPECT_EQ(at(locations, "%IW1"), "2");
    EXPECT_EQ(at(locations, "%IX0.1.0.0"), "4.0") << "behind the direct ones";
    EXPECT_EQ(at(locations, "%IX0.1.0.1"), "4.1");
    EXPECT_EQ(at(locations, "%ID0.1.7"), "8") << "at a multiple of its width";
    EXPECT_EQ(at(locations, "%IW0.2.1"), "12");
    EXPECT_EQ(at(locations, "%IB0.10.0"), "14") << "10 is more than 2";
    EXPECT_EQ(at(locations, "%QW0.1.8192.0"), "0");
    EXPECT_EQ(at(locations, "%QL0.2.0"), "8");
  }
  EXPECT_THAT(
      texts(of(declared).remarks()),
      testing::UnorderedElementsAre(
          "a.st:2:1: %IW0.2.1 lies in bytes 12 to 13 of the inputs. It may move in a later build, unless "
          "[location] of the task file has the line \"%IW0.2.1\" = \"%IW6\"",
          HasSubstr("a.st:4:1: %IX0.1.0.1 lies in bit 1 of byte 4 of the inputs"),
          HasSubstr("\"%ID0.1.7\" = \"%ID2\""), HasSubstr("\"%IX0.1.0.0\" = \"%IX4.0\""),
          HasSubstr("a.st:7:1: %QW0.1.8192.0 lies in bytes 0 to 1 of the outputs"),
          HasSubstr("%IB0.10.0 lies in byte 14 of the inputs"), HasSubstr("\"%QL0.2.0\" = \"%QL1\"")));
}

TEST_F(PlacedLocations, StayWhereTheLinesOfTheRemarksKeepThem) {
  const std::string lines = "[location]\n\"%IW0.1\" = \"%IW0\"\n\"%IW0.2\" = \"%IW1\"\n";
  EXPECT_EQ(at(of({"a AT %IW0.1 : INT", "b AT %IW0.2 : INT"}), "%IW0.2"), "2");
  const std::vector<std::string> more{"a AT %IW0.1 : INT", "b AT %IW0.2 : INT", "c AT %IW0.0 : INT"};
  EXPECT_EQ(at(of(more), "%IW0.2"), "4");
  const Locations kept = of(more, lines);
  EXPECT_EQ(at(kept, "%IW0.1"), "0");
  EXPECT_EQ(at(kept, "%IW0.2"), "2");
  EXPECT_EQ(at(kept, "%IW0.0"), "4") << "behind those that the file has placed";
  EXPECT_THAT(texts(kept.remarks()), ElementsAre(HasSubstr("a.st:4:1: %IW0.0 lies in")));
}

TEST_F(PlacedLocations, AreAllListedForAnOnlineChange) {
  const std::vector<std::string> declared{"a AT %IW1 : INT", "b AT %IW0.1 : INT", "c AT %IX0.0 : BOOL"};
  using Listed = std::pair<std::string, Place>;
  EXPECT_THAT(of(declared).places(),
              ElementsAre(Listed{"%IX0.0", *place_of("%IX0.0")}, Listed{"%IW0.1", *place_of("%IW2")},
                          Listed{"%IW1", *place_of("%IW1")}));
  const Locations apart = of(declared, "locations = 'separate'");
  EXPECT_THAT(apart.places(),
              ElementsAre(Listed{"%IX0.0", *apart.place("%IX0.0")}, Listed{"%IW0.1", *apart.place("%IW0.1")},
                          Listed{"%IW1", *apart.place("%IW1")}));
}

TEST_F(PlacedLocations, LieApartByWidthAsInOpenPlc) {
  const std::vector<std::string> declared{"a AT %QX0.0 : BOOL", "b AT %QX0.1 : BOOL", "c AT %QW0 : INT",
                                          "d AT %IX0.0 : BOOL", "e AT %IW0 : INT",    "f AT %QW0.1 : INT"};
  const Locations locations = of(declared, "locations = 'separate'");
  EXPECT_EQ(at(locations, "%QX0.1"), "0.1");
  EXPECT_EQ(at(locations, "%QW0"), "2048");
  EXPECT_EQ(at(locations, "%IW0"), "2048");
  EXPECT_EQ(at(locations, "%QW0.1"), "2050") << "the next word";
  EXPECT_THAT(texts(locations.remarks()),
              ElementsAre(HasSubstr("a.st:7:1: %QW0.1 lies in bytes 2050 to 2051 of the outputs"),
                          "a.st:5:1: locations = \"separate\": the inputs have %IX0.0 in bit 0 of byte 0, "
                          "%IW0 in bytes 2048 to 2049",
                          testing::AllOf(HasSubstr("a.st:2:1: locations = \"separate\": the outputs have "
                                                   "%QX0.0 in bit 0 of byte 0, %QX0.1 in bit 1 of"),
                                         HasSubstr(", %QW0 in bytes 2048 to 2049, %QW0.1 in bytes 2050"))));
  EXPECT_THAT(at(of({"a AT %QW1024 : INT"}, "locations = 'separate'"), "%QW1024"),
              HasSubstr("'%QW1024' is no place: allowed are the numbers 0 to 1023 there"));
}

TEST_F(PlacedLocations, ThatShareBitsAreTold) {
  EXPECT_THAT(
      texts(of({"a AT %QX0.0 : BOOL", "b AT %QX0.1 : BOOL", "c AT %QW0 : INT", "d AT %QB2 : BYTE",
                "e AT %IX0.0 : BOOL", "f AT %IW0 : INT"})
                .remarks()),
      ElementsAre("a.st:7:1: %IW0 shares its bits with %IX0.0: a value at one of them changes the "
                  "others. If they lie apart, as in OpenPLC, set locations = \"separate\" in the task "
                  "file",
                  HasSubstr("a.st:4:1: %QW0 shares its bits with %QX0.0, %QX0.1: ")));
  EXPECT_THAT(
      texts(of({"a AT %MD0 : DINT", "b AT %MW1 : INT", "c AT %MB2 : BYTE", "d AT %MB4 : BYTE"}).remarks()),
      ElementsAre(HasSubstr("a.st:2:1: %MD0 shares its bits with %MW1, %MB2: ")));
  EXPECT_THAT(texts(of({"a AT %QX0 : BOOL", "b AT %QX0.0 : BOOL", "c AT %Q0.0 : BOOL"}).remarks()), IsEmpty())
      << "one location, written in several ways";
  std::vector<std::string> bits{"w AT %QW0 : INT"};
  for (int i = 0; i < 10; ++i) bits.push_back(fmt::format("b{} AT %QX{}.{} : BOOL", i, i / 8, i % 8));
  EXPECT_THAT(texts(of(bits).remarks()), ElementsAre(HasSubstr("%QX0.7 and 2 more: ")));
}

TEST_F(PlacedLocations, OfTheTaskFileMayShareBitsAndAreTold) {
  const Locations locations =
      of({"a AT %IW0.1 : INT", "b AT %IW2 : INT", "c AT %IX0.9 : BOOL", "d AT %IW3 : INT"},
         "[location]\n'%IW0.1' = '%IW2'\n'%IX0.9' = '%IX1.1'\n'%IW3' = '%IW7'\n'%IW0.3' = '%IW9'");
  EXPECT_EQ(at(locations, "%IW0.1"), "4");
  EXPECT_EQ(at(locations, "%IX0.9"), "1.1");
  EXPECT_EQ(at(locations, "%IW3"), "14");
  EXPECT_THAT(texts(locations.remarks()), ElementsAre(HasSubstr("%IW0.1 shares its bits with %IW2"),
                                                      "a.toml:5:1: no variable lies at %IW0.3"));
}

TEST_F(PlacedLocations, ThatHaveNoPlaceAreRefusedWithTheWayOut) {
  const Locations locations = of({"a AT %IX0.9 : BOOL"});
  EXPECT_THAT(
      at(locations, "%IX0.9"),
      HasSubstr("'%IX0.9' is no place: allowed are %I, %Q or %M with X0.0, B0, W0, D0 or L0, or give it "
                "a line in [location] of the task file"));
  EXPECT_THAT(texts(locations.remarks()), IsEmpty());
  const TaskPlan plan = plan_tasks(project, project.configurations.at(0),
                                   project.configurations.at(0).resources.at(0), Compiler::matiec);
  EXPECT_THAT(texts(plan.problems), ElementsAre(HasSubstr("a.st:2:1: '%IX0.9' is no place")));
}

TEST_F(PlacedLocations, HaveOneTypeAtOnePlaceWithMatiec) {
  (void)of({"a AT %IW0.1 : INT", "b AT %IW2 : WORD"}, "[location]\n'%IW0.1' = '%IW2'");
  const iec::Configuration& configuration = project.configurations.at(0);
  const auto problems = [&](Compiler compiler) {
    return texts(plan_tasks(project, configuration, configuration.resources.at(0), compiler).problems);
  };
  EXPECT_THAT(problems(Compiler::matiec),
              ElementsAre(HasSubstr("a.st:3:1: %IW2 is WORD here and INT elsewhere")));
  EXPECT_THAT(problems(Compiler::strucpp), IsEmpty());
}

TEST_F(PlacedLocations, AreToldOnceForAllResources) {
  const std::vector<Source> sources{
      {"a.st",
       "PROGRAM Main VAR a AT %IW0.1 : INT; END_VAR END_PROGRAM CONFIGURATION cell "
       "RESOURCE press ON PLC TASK t (INTERVAL := T#1s, PRIORITY := 1); PROGRAM p WITH t : Main; "
       "END_RESOURCE "
       "RESOURCE robot ON PLC TASK u (INTERVAL := T#1s, PRIORITY := 1); PROGRAM q WITH u : Main; "
       "END_RESOURCE "
       "END_CONFIGURATION"}};
  const Project two = read_project(sources).project;
  const Configuration& cell = two.configurations.at(0);
  EXPECT_THAT(texts(plan_tasks(two, cell, cell.resources.at(0), Compiler::matiec).remarks),
              ElementsAre(HasSubstr("%IW0.1 lies in")));
  EXPECT_THAT(texts(plan_tasks(two, cell, cell.resources.at(1), Compiler::matiec).remarks), IsEmpty());
}

}  // namespace
}  // namespace plchost::iec
