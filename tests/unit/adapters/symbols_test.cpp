#include "instances/adapters/matiec/symbols.hpp"

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>

#include "instances/adapters/iec/compiler.hpp"
#include "instances/plc_variables.h"

namespace plchost::matiec {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::SizeIs;

// The symbols of a resource with the tasks `fast` and `slow`.
Symbols symbols(const std::string& programs, const std::string& globals, const std::string& instances) {
  const std::vector<iec::Source> sources{
      {"a.st", programs},
      {"c.st", "CONFIGURATION cell\n" + globals +
                   "\nRESOURCE press ON PLC\nTASK fast (INTERVAL := T#1ms, PRIORITY := 1);\n"
                   "TASK slow (INTERVAL := T#9ms, PRIORITY := 2);\n" +
                   instances + "\nEND_RESOURCE END_CONFIGURATION"}};
  const auto [project, problems] = iec::read_project(sources);
  EXPECT_TRUE(problems.empty()) << iec::describe(problems.front());
  const iec::Configuration& configuration = project.configurations.at(0);
  const auto plan =
      iec::plan_tasks(project, configuration, configuration.resources.at(0), iec::Compiler::matiec);
  return symbols_of(project, configuration.resources.at(0), plan,
                    [](const iec::Place& place, std::optional<std::size_t> task) {
                      return fmt::format("place_{}_{}", place.offset,
                                         task ? fmt::format("{}", *task) : "all");
                    });
}

std::map<std::string, Symbol> by_name(const Symbols& symbols) {
  std::map<std::string, Symbol> result;
  for (const Symbol& symbol : symbols.all) result[symbol.name] = symbol;
  return result;
}

TEST(MatiecSymbols, AreOfProgramsBlocksAndGlobals) {
  const auto found = by_name(symbols(
      "FUNCTION_BLOCK Pump VAR_INPUT go : BOOL; END_VAR VAR hours : LREAL; late : TON; END_VAR ; "
      "END_FUNCTION_BLOCK\n"
      "PROGRAM Main VAR_EXTERNAL total : DINT; END_VAR VAR CONSTANT five : INT := 5; END_VAR\n"
      "VAR_TEMP t : INT; END_VAR VAR speed : INT; left : Pump; END_VAR ; END_PROGRAM",
      "VAR_GLOBAL total : DINT; END_VAR", "PROGRAM one WITH fast : Main; PROGRAM two WITH slow : Main;"));
  EXPECT_THAT(found, SizeIs(15));  // 7 of each program, and a global
  EXPECT_EQ(found.at("one.speed").value, "PRESS__ONE.SPEED.value");
  EXPECT_EQ(found.at("one.speed").task, "fast");
  EXPECT_EQ(found.at("two.speed").task, "slow");
  EXPECT_EQ(found.at("one.left.hours").value, "PRESS__ONE.LEFT.HOURS.value");
  EXPECT_EQ(found.at("one.left.hours").type, PLC_TYPE_LREAL);
  EXPECT_EQ(found.at("one.left.late.ET").value, "PRESS__ONE.LEFT.LATE.ET.value");
  EXPECT_EQ(found.at("one.left.late.ET").type, PLC_TYPE_TIMESPEC_TIME);
  EXPECT_EQ(found.at("total").value, "(*__GET_GLOBAL_TOTAL())");
  EXPECT_EQ(found.at("total").task, "");  // two tasks use it
}

TEST(MatiecSymbols, AreOfGlobalBlocks) {
  const Symbols told = symbols(
      "FUNCTION_BLOCK Pump VAR_INPUT go : BOOL; END_VAR ; END_FUNCTION_BLOCK\n"
      "PROGRAM Main VAR_EXTERNAL late : TON; left : Pump; END_VAR ; END_PROGRAM",
      "VAR_GLOBAL late : TON; left : Pump; END_VAR", "PROGRAM one WITH fast : Main;");
  const auto found = by_name(told);
  EXPECT_THAT(found, SizeIs(5));
  EXPECT_EQ(found.at("late.ET").value, "(*__GET_GLOBAL_LATE()).ET.value");
  EXPECT_EQ(found.at("left.go").value, "(*__GET_GLOBAL_LEFT()).GO.value");
  EXPECT_EQ(found.at("left.go").task, "fast");
  EXPECT_THAT(told.instances, Contains(testing::Field(&SymbolInstance::path, "left")));
  EXPECT_THAT(told.remarks, testing::IsEmpty());
}

TEST(MatiecSymbols, AreOfAllBlocksOfItsLibrary) {
  const Symbols told = symbols(
      "PROGRAM Main VAR c : CTU; d : CTD_ULINT; b : CTUD_Dint; p : PID; r : RAMP; s : SEMA; i : INTEGRAL; "
      "v : DERIVATIVE; h : HYSTERESIS; END_VAR ; END_PROGRAM",
      "", "PROGRAM one WITH fast : Main;");
  EXPECT_THAT(told.remarks, testing::IsEmpty());
  const auto found = by_name(told);
  EXPECT_EQ(found.at("one.c.CV").type, PLC_TYPE_INT);
  EXPECT_EQ(found.at("one.d.PV").type, PLC_TYPE_ULINT);
  EXPECT_EQ(found.at("one.b.CV").type, PLC_TYPE_DINT);
  EXPECT_EQ(found.at("one.b.QD").value, "PRESS__ONE.B.QD.value");
  EXPECT_EQ(found.at("one.p.XOUT").type, PLC_TYPE_REAL);
  EXPECT_EQ(found.at("one.r.TR").type, PLC_TYPE_TIMESPEC_TIME);
  for (const char* const output : {"one.s.BUSY", "one.i.XOUT", "one.v.XOUT", "one.h.Q"})
    EXPECT_TRUE(found.contains(output)) << output;
}

TEST(MatiecSymbols, TellTheElementsOfArraysAndTheMembersOfStructures) {
  const auto found = by_name(
      symbols("TYPE Point : STRUCT x, y : REAL; tags : ARRAY[1..3] OF INT; name : STRING; END_STRUCT;\n"
              "Color : (red, green); Small : INT (0..10); Grid : ARRAY[-1..1, 0..3] OF Point; END_TYPE\n"
              "PROGRAM Main VAR p : Point; c : Color; s1 : Small; gr : Grid; list : ARRAY[0..7] OF TIME; "
              "END_VAR ; END_PROGRAM",
              "", "PROGRAM one WITH fast : Main;"));
  EXPECT_EQ(found.at("one.p.Y").value, "PRESS__ONE.P.value.Y");
  EXPECT_EQ(found.at("one.p.NAME").type, PLC_TYPE_COUNTED_STRING);
  const Symbol& tags = found.at("one.p.TAGS[]");
  EXPECT_EQ(tags.value, "PRESS__ONE.P.value.TAGS.table[0]");
  ASSERT_THAT(tags.dimensions, SizeIs(1));
  EXPECT_EQ(tags.dimensions[0].first, 1);
  EXPECT_EQ(tags.dimensions[0].count, 3U);
  EXPECT_EQ(tags.dimensions[0].stride, "sizeof(PRESS__ONE.P.value.TAGS.table[0])");
  EXPECT_EQ(found.at("one.c").type, PLC_TYPE_DINT);
  EXPECT_EQ(found.at("one.s1").type, PLC_TYPE_INT);
  const Symbol& deep = found.at("one.gr[][].TAGS[]");
  EXPECT_EQ(deep.value, "PRESS__ONE.GR.value.table[0][0].TAGS.table[0]");
  ASSERT_THAT(deep.dimensions, SizeIs(3));
  EXPECT_EQ(deep.dimensions[0].first, -1);
  EXPECT_EQ(deep.dimensions[0].stride, "sizeof(PRESS__ONE.GR.value.table[0])");
  EXPECT_EQ(deep.dimensions[1].stride, "sizeof(PRESS__ONE.GR.value.table[0][0])");
  EXPECT_EQ(found.at("one.list[]").type, PLC_TYPE_TIMESPEC_TIME);
}

TEST(MatiecSymbols, OfLocatedVariablesLieWhereTheirTaskHasThem) {
  const auto found =
      by_name(symbols("PROGRAM Main VAR raw AT %IW1 : INT; END_VAR ; END_PROGRAM",
                      "VAR_GLOBAL lamp AT %QX0.1 : BOOL; END_VAR", "PROGRAM one WITH slow : Main;"));
  EXPECT_EQ(found.at("one.raw").value, "place_2_0");
  EXPECT_EQ(found.at("one.raw").area, "%IW1");
  EXPECT_EQ(found.at("lamp").value, "place_0_all");
  EXPECT_EQ(found.at("lamp").type, PLC_TYPE_BOOL);
}

TEST(MatiecSymbols, SayWhichVariablesCannotBeSeen) {
  const Symbols found = symbols(
      "TYPE Plane : ARRAY[0..1, 0..1] OF INT; END_TYPE\n"
      "PROGRAM Main VAR a : ARRAY[0..1, 0..1] OF Plane; b : Unknown; c : INT; END_VAR ; END_PROGRAM",
      "", "PROGRAM one WITH fast : Main;");
  ASSERT_THAT(found.all, SizeIs(1));
  std::vector<std::string> remarks;
  for (const auto& remark : found.remarks) remarks.push_back(remark.text);
  EXPECT_THAT(remarks, Contains(HasSubstr("it has more than 3 dimensions")));
}

}  // namespace
}  // namespace plchost::matiec
