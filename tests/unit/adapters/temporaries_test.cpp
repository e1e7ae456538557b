#include "instances/adapters/matiec/temporaries.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/adapters/matiec/joined_source.hpp"

namespace plchost::matiec {
namespace {

using testing::HasSubstr;

std::string with_values(std::string_view code, const std::string& variables) {
  const std::vector<iec::Source> sources{
      {"a.st",
       "FUNCTION_BLOCK Fb VAR_TEMP " + variables +
           " END_VAR VAR n : INT; END_VAR n := 1; END_FUNCTION_BLOCK\nPROGRAM Main VAR grid : INT; END_VAR "
           "grid := 1; END_PROGRAM"}};
  return with_temporary_values(code, iec::read_project(sources).project);
}

// In the shape of what iec2c writes.
constexpr std::string_view kInitOfBlock =
    "void FB_init__(FB *data__, BOOL retain) {\n"
    "  __INIT_VAR(data__->N,0,retain)\n"
    "  {\n    static const __ARRAY_OF_INT_2 temp = {{1,2}};\n    __SET_VAR(data__->,GRID,,temp);\n  }\n"
    "  __INIT_VAR(data__->GRIDS,__STRING_LITERAL(8,\",retain)\"),retain)\n"
    "  TON_init__(&data__->PAUSE,retain);\n"
    "}\n\n";
constexpr std::string_view kBodyOfBlock =
    "// Code part\nvoid FB_body__(FB *data__) {\n  // Initialise TEMP variables\n\n"
    "  __SET_VAR(data__->,N,,1);\n}\n";

TEST(TemporaryValuesOfMatiec, AreSetAtTheBeginOfEachCall) {
  const std::string code = std::string(kInitOfBlock) + std::string(kBodyOfBlock);
  EXPECT_EQ(
      with_values(code, "pause : TON; grid : ARRAY[0..1] OF INT; grids : STRING;"),
      std::string(kInitOfBlock) +
          "// Code part\nvoid FB_body__(FB *data__) {\n  // Initialise TEMP variables\n"
          "  TON_init__(&data__->PAUSE,0);\n"
          "  {\n    static const __ARRAY_OF_INT_2 temp = {{1,2}};\n    __SET_VAR(data__->,GRID,,temp);\n  }\n"
          "  __INIT_VAR(data__->GRIDS,__STRING_LITERAL(8,\",retain)\"),0)\n"
          "\n  __SET_VAR(data__->,N,,1);\n}\n");
  EXPECT_EQ(with_values(code, "other : INT;"), code);
}

TEST(TemporaryValuesOfMatiec, AreThoseOfItsOwnPou) {
  const std::string main =
      "void MAIN_init__(MAIN *data__, BOOL retain) {\n  __INIT_VAR(data__->GRID,5,retain)\n}\n"
      "void MAIN_body__(MAIN *data__) {\n  // Initialise TEMP variables\n\n}\n";
  EXPECT_EQ(with_values(main, "grid : INT;"), main);
  for (const char* const code : {"", "\n", "void FB_init__(FB *data__, BOOL retain) {\n", "void FB_init__(",
                                 "  // Initialise TEMP variables\n", "void FB_body__(FB *data__) {\n  x"}) {
    EXPECT_EQ(with_values(code, "grid : INT;"), code);
  }
}

TEST(TemporaryValuesOfMatiec, AreThoseOfVariablesInVar) {
  const std::vector<iec::Source> sources{
      {"a.st",
       "FUNCTION f : INT var_temp a : INT; END_VAR END_FUNCTION\nPROGRAM p var_temp x : INT; END_VAR\n x;"}};
  const JoinedSource joined(sources);
  EXPECT_THAT(joined.text(), HasSubstr("INT var_temp a : INT;"));
  EXPECT_THAT(joined.text(), HasSubstr("PROGRAM p var      x : INT;"));
}

}  // namespace
}  // namespace plchost::matiec
