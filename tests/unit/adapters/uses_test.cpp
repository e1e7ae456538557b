#include "instances/adapters/matiec/uses.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "tests/unit/adapters/problem_texts.hpp"

namespace plchost::matiec {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kLogger = R"(FUNCTION_BLOCK LOGGER
  VAR_INPUT TRIG : BOOL; END_VAR
  IF TRIG THEN
  {{
   LogMessage(GetFbVar(TRIG));
  }}
  END_IF;
  {enable code generation}
  { __tick; }
END_FUNCTION_BLOCK
)";
constexpr const char* kMain = "PROGRAM Main VAR a : INT; END_VAR a := 1; END_PROGRAM\n";
constexpr const char* kEnd =
    "CONFIGURATION c RESOURCE r ON PLC TASK t (INTERVAL := T#1s, PRIORITY := 1); PROGRAM p WITH t : Main; "
    "END_RESOURCE END_CONFIGURATION\n";

struct Blanked {
  std::vector<std::string> remarks;
  std::vector<iec::Source> sources;
};
Blanked blanked(std::vector<iec::Source> sources) {
  Blanked result;
  result.remarks = texts(blank_unused_pragmas(sources));
  result.sources = std::move(sources);
  return result;
}

TEST(CodeInPragmas, IsLeftOutOfPousThatNoProgramUses) {
  const Blanked made = blanked({{"a.st", std::string("{ int kept; }\n") + kLogger + kMain}, {"b.st", kEnd}});
  EXPECT_THAT(
      made.remarks,
      ElementsAre("a.st:2:16: FUNCTION_BLOCK LOGGER is not used by a program of the CONFIGURATION: the "
                  "C in its pragmas is left out"));
  EXPECT_EQ(made.sources[0].text, std::string(R"({ int kept; }
FUNCTION_BLOCK LOGGER
  VAR_INPUT TRIG : BOOL; END_VAR
  IF TRIG THEN
  {{
                              
  }}
  END_IF;
  {enable code generation}
  {         }
END_FUNCTION_BLOCK
)") + kMain);
  EXPECT_EQ(made.sources[1].text, kEnd);
}

TEST(CodeInPragmas, StaysInPousThatAProgramUses) {
  const std::string block = "FUNCTION_BLOCK Outer VAR one : logger; END_VAR one(); END_FUNCTION_BLOCK\n";
  for (const std::string& main :
       {std::string("PROGRAM Main VAR a : Logger; END_VAR a(); END_PROGRAM\n"),
        block + "PROGRAM Main VAR a : Outer; END_VAR a(); END_PROGRAM\n",
        block + "TYPE Both : STRUCT a : Outer; END_STRUCT; END_TYPE\n" + kMain,
        std::string("PROGRAM Main VAR a : INT; END_VAR {{ LOGGER_body__(&x); }} END_PROGRAM\n")}) {
    SCOPED_TRACE(main);
    const Blanked made = blanked({{"a.st", kLogger + main}, {"b.st", kEnd}});
    EXPECT_THAT(made.remarks, IsEmpty());
    EXPECT_EQ(made.sources[0].text, kLogger + main);
  }
}

TEST(CodeInPragmas, IsLeftOutOfAProgramWithoutAnInstance) {
  const std::string text =
      "FUNCTION_BLOCK Outer VAR one : logger; END_VAR one(); END_FUNCTION_BLOCK\n"
      "PROGRAM Other VAR a : Outer; END_VAR { __tick; } END_PROGRAM\n";
  EXPECT_THAT(blanked({{"a.st", kLogger + text + kMain}, {"b.st", kEnd}}).remarks,
              ElementsAre(HasSubstr("FUNCTION_BLOCK LOGGER"), HasSubstr("a.st:12:9: PROGRAM Other")));
}

TEST(CodeInPragmas, OfAnyTextIsRead) {
  for (const char* text : {"", "PROGRAM", "FUNCTION {} END_FUNCTION", "END_FUNCTION { x", "{{"})
    EXPECT_THAT(blanked({{"a.st", text}}).remarks, IsEmpty());
  EXPECT_EQ(blanked({{"a.st", "FUNCTION f { x }"}, {"b.st", "{ y }"}}).sources[1].text, "{ y }");
  EXPECT_EQ(blanked({{"a.st", "FUNCTION f {{x"}}).sources[0].text.size(), 14U);
}

bool in_order(const std::vector<iec::Source>& sources) {
  return declares_before_use(sources);
}

TEST(Uses, StandBehindTheDeclarationsOrNot) {
  EXPECT_TRUE(in_order({{"a.st", kLogger}, {"b.st", kMain}, {"c.st", kEnd}}));
  EXPECT_FALSE(in_order({{"a.st", kEnd}, {"b.st", kMain}})) << "the configuration uses Main";
  const std::string uses = "FUNCTION_BLOCK Outer VAR one : logger; END_VAR one(); END_FUNCTION_BLOCK\n";
  EXPECT_TRUE(in_order({{"a.st", kLogger + uses}}));
  EXPECT_FALSE(in_order({{"a.st", uses + kLogger}}));
  EXPECT_FALSE(in_order({{"a.st", "FUNCTION f : Mode f := 1; END_FUNCTION TYPE Mode : INT; END_TYPE"}}));
  EXPECT_TRUE(in_order({{"a.st", "TYPE Mode : INT; END_TYPE FUNCTION f : Mode f := 1; END_FUNCTION"}}));
  EXPECT_TRUE(in_order({{"a.st", "(* LOGGER *) { LOGGER }\n" + std::string(kLogger)}}));
}

}  // namespace
}  // namespace plchost::matiec
