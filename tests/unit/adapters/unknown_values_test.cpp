#include "instances/adapters/matiec/unknown_values.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "tests/unit/adapters/problem_texts.hpp"

namespace plchost::matiec {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr const char* kTypes =
    "TYPE Mode : (idle, busy) := idle; Other : (up, down); Same : Mode;\n"
    "Rec : STRUCT m : Mode := busy; n : INT; s : Same; END_STRUCT; Deep : STRUCT r : Rec; o : Other; "
    "END_STRUCT; Rows : ARRAY [1..2] OF Rec; Modes : ARRAY [1..3] OF Mode; END_TYPE\nPROGRAM P VAR\n";

// Of the declarations, which begin in line 4.
std::vector<std::string> unknown(const std::string& declarations) {
  const std::vector<iec::Source> sources{
      {"a.st", kTypes + declarations + "\nEND_VAR x := (nix); END_PROGRAM"}};
  return texts(unknown_values(sources, iec::read_project(sources).project));
}

TEST(UnknownValues, AreFoundInInitialValuesOfStructures) {
  EXPECT_THAT(unknown("r : Rec := (n := 3, m := bussy);"),
              ElementsAre("a.st:4:26: 'bussy' is no value of MODE; it has IDLE, BUSY"));
  EXPECT_THAT(unknown("r : Rec := (m := up, s := down);"),
              ElementsAre("a.st:4:18: 'up' is no value of MODE; it has IDLE, BUSY",
                          "a.st:4:27: 'down' is no value of SAME; it has IDLE, BUSY"));
  EXPECT_THAT(unknown("r : Rec := (m := Mode#nix);"),
              ElementsAre("a.st:4:18: 'Mode#nix' is no value of MODE; it has IDLE, BUSY"));
  EXPECT_THAT(unknown("r : Rec := (n := nix);"),
              ElementsAre("a.st:4:18: 'nix' is no value of an enumeration; initial values are literals, or "
                          "values of an enumeration"));
}

TEST(UnknownValues, AreFoundInsideOfOthers) {
  EXPECT_THAT(unknown("d : Deep := (r := (n := 1, m := nix), o := left);"),
              ElementsAre("a.st:4:33: 'nix' is no value of MODE; it has IDLE, BUSY",
                          "a.st:4:44: 'left' is no value of OTHER; it has UP, DOWN"));
  EXPECT_THAT(unknown("a : ARRAY [1..2] OF Rec := [(m := idle), (m := nix)]; b : Rows := [2((m := nix))];"),
              ElementsAre("a.st:4:48: 'nix' is no value of MODE; it has IDLE, BUSY",
                          "a.st:4:76: 'nix' is no value of MODE; it has IDLE, BUSY"));
  EXPECT_THAT(unknown("m : Modes := [idle, 2(nix)];"),
              ElementsAre("a.st:4:23: 'nix' is no value of MODE; it has IDLE, BUSY"));
}

TEST(UnknownValues, AreNotThoseThatAreRight) {
  EXPECT_THAT(
      unknown("r : Rec := (m := BUSY, n := INT#3, s := Same#idle); d : Deep := (o := Up, r := (m := idle));"
              "m : Modes := [idle, 2(busy)]; b : Rows := [(n := 1), (m := busy)]; plain : Mode := nix;"
              "own : (left, ahead) := left; f : ARRAY [1..2] OF BOOL := [TRUE, FALSE]; t : TON;"),
      IsEmpty());
}

// Any text.
TEST(UnknownValues, EndWithTheText) {
  EXPECT_THAT(unknown("r : Rec := (m := ((((("), IsEmpty());
  EXPECT_THAT(unknown("r : Rec := )))(m := "), IsEmpty());
  EXPECT_THAT(unknown("r : Circle := (m := ["), IsEmpty());
}

}  // namespace
}  // namespace plchost::matiec
