#include "instances/adapters/matiec/declared.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace plchost::matiec {
namespace {

const std::vector<iec::Source> kOfDeclarations{
    {"line.st",
     "TYPE Grid : ARRAY[1..2] OF INT; END_TYPE\n"
     "FUNCTION Sum : INT VAR_INPUT a : INT; END_VAR VAR row : Grid; END_VAR Sum := a; END_FUNCTION\n"
     "FUNCTION_BLOCK Pump VAR hours : INT; END_VAR hours := 1; END_FUNCTION_BLOCK\n"
     "PROGRAM Main VAR pump1 : Pump; hours : Grid; END_VAR pump1(); END_PROGRAM\n"
     "CONFIGURATION cell VAR_GLOBAL limit1 : Grid; END_VAR RESOURCE r ON PLC VAR_GLOBAL flag : BOOL; "
     "END_VAR\n"
     "TASK t (INTERVAL := T#1s, PRIORITY := 1); PROGRAM m WITH t : Main; END_RESOURCE END_CONFIGURATION\n"}};

// In the shape of what iec2c writes.
constexpr std::string_view kHeaderOfIec2c =
    "__DECLARE_ARRAY_TYPE(GRID,INT,[2])\n"                     // 1
    "// FUNCTION\nINT SUM(BOOL EN, INT A);\n"                  // 3
    "// FUNCTION_BLOCK PUMP\n// Data part\n"                   // 5
    "typedef struct {\n  __DECLARE_VAR(INT,HOURS)\n} PUMP;\n"  // 8
    "// PROGRAM MAIN\ntypedef struct {\n"                      // 10
    "  PUMP PUMP1;\n  __DECLARE_VAR(GRID,HOURS)\n"             // 12
    "} MAIN;\n__DECLARE_GLOBAL(GRID,CELL,LIMIT1)\n";           // 14
constexpr std::string_view kCodeOfIec2c =
    "PLCHOST_ONCE void MAIN_init__(MAIN *data__, BOOL retain) {\n"  // 1
    "  PUMP_init__(&data__->PUMP1,retain);\n"
    "  __INIT_VAR(data__->HOURS,__INITIAL_VALUE(GRID,{1,2}),retain)\n}\n"
    "void PUMP_body__(PUMP *data__) {\n"  // 5
    "  __SET_VAR(data__->,HOURS,,1);\n  x(\"HOURS\");\n} // PUMP_body__()\n"
    "// FUNCTION\nINT SUM(\n  BOOL EN, INT A)\n  {\n  GRID ROW = {{0,0}};\n"  // 13
    "}\nvoid config_init__(void) {\n  __INIT_GLOBAL(BOOL,FLAG,0)\n";          // 16

std::string told(std::string_view code, unsigned line) {
  const iec::Project project = iec::read_project(kOfDeclarations).project;
  const auto found = declared_in(code, line, project);
  return found ? iec::describe({found->place, found->what}) : "";
}

TEST(Declarations, AreTheMembersOfTheStructuresOfTheirPou) {
  EXPECT_EQ(told(kHeaderOfIec2c, 1), "line.st:1:6: type 'Grid'");
  EXPECT_EQ(told(kHeaderOfIec2c, 7), "line.st:3:25: variable 'hours'");
  EXPECT_EQ(told(kHeaderOfIec2c, 11), "line.st:4:18: variable 'pump1'");
  EXPECT_EQ(told(kHeaderOfIec2c, 12), "line.st:4:32: variable 'hours'");
  EXPECT_EQ(told(kHeaderOfIec2c, 14), "line.st:5:31: variable 'limit1'");
}

TEST(Declarations, AreTheVariablesThatGetAnInitialValue) {
  EXPECT_EQ(told(kCodeOfIec2c, 2), "line.st:4:18: variable 'pump1'");
  EXPECT_EQ(told(kCodeOfIec2c, 3), "line.st:4:32: variable 'hours'");
  EXPECT_EQ(told(kCodeOfIec2c, 6), "line.st:3:25: variable 'hours'");
  EXPECT_EQ(told(kCodeOfIec2c, 13), "line.st:2:51: variable 'row'");
  EXPECT_EQ(told(kCodeOfIec2c, 16), "line.st:5:83: variable 'flag'");
}

TEST(Declarations, IsThePouIfTheLineNamesNoneOfItsVariables) {
  EXPECT_EQ(told(kCodeOfIec2c, 7), "line.st:3:16: 'Pump'");
}

TEST(Declarations, NothingIsInCodeOfNoDeclaration) {
  EXPECT_EQ(told("", 1), "");
  EXPECT_EQ(told("x\ny", 3), "");
  EXPECT_EQ(told("x\ny", 0), "");
  EXPECT_EQ(told("// FUNCTION\n// PROGRAM \nvoid \n}\nvoid (\nvoid _init__(\n\"", 7), "");
}

}  // namespace
}  // namespace plchost::matiec
