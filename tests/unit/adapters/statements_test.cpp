#include "instances/adapters/matiec/statements.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace plchost::matiec {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

unsigned same_line(std::string_view /*file*/, unsigned line) {
  return line;
}

// In the shape of what iec2c writes. The second source begins at line 4 of the joined one.
constexpr const char* kCode = R"(// FUNCTION
INT TWICE(
  BOOL EN,
  INT X)
{
  INT TWICE = 0;
  if (!EN) {
    return TWICE;
  }
#line 2 "joined.st"
  TWICE = (X * 2);
__end:
  return TWICE;
}

void MAIN_init__(MAIN *data__, BOOL retain) {
  __INIT_VAR(data__->TOTAL,0,retain)
}

// Code part
void MAIN_body__(MAIN *data__) {
  // Initialise TEMP variables

#line 6 "joined.st"
  if (__GET_VAR(data__->GO,)) {
#line 5 "joined.st"
    __SET_VAR(data__->,TOTAL,,1);
  };
#line 6 "joined.st"
  __SET_VAR(data__->,TOTAL,,2);
}

void EMPTY_body__(EMPTY *data__) {
  return;
}
)";

TEST(MatiecStatements, GetTheirMacros) {
  const std::vector<iec::Source> sources{{"a.st", "FUNCTION Twice\nTwice := x * 2;\nEND_FUNCTION\n"},
                                         {"b \"1\".st", "PROGRAM Main\nx\ny\nEND_PROGRAM\n"}};
  const DebugCode made = with_statements(kCode, JoinedSource(sources), {}, same_line);
  ASSERT_EQ(made.pous.size(), 2U);
  EXPECT_EQ(made.pous[0].name, "TWICE");
  EXPECT_EQ(made.pous[0].file, "a.st");
  EXPECT_THAT(made.pous[0].lines, ElementsAre(2));
  EXPECT_EQ(made.pous[1].name, "MAIN");
  EXPECT_EQ(made.pous[1].file, "b \"1\".st");
  EXPECT_THAT(made.pous[1].lines, ElementsAre(3, 2, 3));
  EXPECT_THAT(made.text, HasSubstr("  INT X)\n{\n  PLC_ENTER(plchost_pou_0, 0);\n"));
  EXPECT_THAT(made.text, HasSubstr("PLC_STATEMENT(2u);\n  TWICE = (X * 2);\n"));
  EXPECT_THAT(made.text,
              HasSubstr("void MAIN_body__(MAIN *data__) {\n  PLC_ENTER(plchost_pou_1, data__);\n"));
  EXPECT_THAT(
      made.text,
      HasSubstr("PLC_STATEMENT(3u);\n  if (__GET_VAR(data__->GO,)) {\n/* line 5 */\nPLC_STATEMENT(2u);\n"));
  EXPECT_THAT(made.text, HasSubstr("void MAIN_init__(MAIN *data__, BOOL retain) {\n  __INIT_VAR"));
  EXPECT_THAT(made.text, HasSubstr("void EMPTY_body__(EMPTY *data__) {\n  return;\n"));
  EXPECT_THAT(made.text, Not(HasSubstr("#line")));
  const std::string_view until = std::string_view(made.text).substr(0, made.text.find("  TWICE = (X * 2);"));
  EXPECT_EQ(joined_line_of(made.text, static_cast<unsigned>(std::ranges::count(until, '\n')) + 1), 2U)
      << "for the errors of the C compiler";
  const std::string header = iec::debug_header(made.pous);
  EXPECT_THAT(header, HasSubstr("plchost_lines_1[] = {2u, 3u};"));
  EXPECT_THAT(header, HasSubstr("\"MAIN\", \"b \\\"1\\\".st\", plchost_lines_1, 2u, 0u, 0, 0u, 0, 0u};"));
}

constexpr const char* kLocals = R"(// FUNCTION
INT SUM(
  BOOL EN,
  BOOL *__ENO,
  INT X,
  INT *__CALLS)
{
  BOOL ENO = __BOOL_LITERAL(TRUE);
  INT CALLS;
  if (__CALLS != NULL) {
    CALLS = *__CALLS;
  }
  INT SUM = 0;

  // Control execution
  if (!EN) {
    return SUM;
  }
  I = 1;
  {
    while(I < 3) {
#line 13 "joined.st"
      CALLS = (CALLS + X);
    }
  }
  return SUM;
}

void PART_body__(PART *data__) {
  // Control execution
#line 19 "joined.st"
  __SET_VAR(data__->,TMP,,1);
}
)";

constexpr const char* kLocalsText = R"(TYPE
  Mode : (off, on);
  Small : INT (0..9);
  At : STRUCT x, y : REAL; mode : Mode; END_STRUCT;
END_TYPE
FUNCTION Sum : INT
  VAR_INPUT x : INT; END_VAR
  VAR_IN_OUT calls : INT; END_VAR
  VAR m : Mode; small : Small; place : At; cells : ARRAY [1..3] OF INT; late : TIME; s : STRING; END_VAR
  VAR CONSTANT k : BYTE := 3; END_VAR
  VAR_EXTERNAL g : INT; END_VAR
  FOR i := 1 TO 3 DO
    calls := calls + x;
  END_FOR;
END_FUNCTION
FUNCTION_BLOCK Part
  VAR_INPUT in : INT; END_VAR VAR_IN_OUT io : At; other : Part; END_VAR VAR_TEMP tmp : WORD; END_VAR
  VAR n : INT; END_VAR
  tmp := 1;
END_FUNCTION_BLOCK
)";

TEST(MatiecLocals, AreThoseOfTheCThatAreNoSymbols) {
  const std::vector<iec::Source> sources{{"a.st", kLocalsText}};
  const iec::ReadProject read = iec::read_project(sources);
  ASSERT_TRUE(read.problems.empty());
  const DebugCode made = with_statements(kLocals, JoinedSource(sources), read.project, same_line);
  ASSERT_EQ(made.pous.size(), 2U);
  const auto shown = [](const iec::DebugPou& pou) {
    std::vector<std::string> all;
    for (const iec::DebugLocal& one : pou.locals) {
      all.push_back(one.name + " " + one.type + " " + one.bytes + " " + one.address);
      for (const auto& [first, count, stride] : one.dimensions)
        all.back() += fmt::format(" {}+{} {}", first, count, stride);
    }
    return all;
  };
  EXPECT_THAT(shown(made.pous[0]),
              ElementsAre("x 3u 0 &X", "calls 3u 0 &CALLS", "m 4u 0 &M", "small 3u 0 &SMALL",
                          "place.X 14u 0 &PLACE.X", "place.Y 14u 0 &PLACE.Y", "place.MODE 4u 0 &PLACE.MODE",
                          "cells[] 3u 0 &CELLS.table[0] 1+3 1u * sizeof(INT)", "late 21u 0 &LATE",
                          "s 25u sizeof(STRING) &S", "k 10u 0 &K", "Sum 3u 0 &SUM"));
  EXPECT_THAT(shown(made.pous[1]),
              ElementsAre("io.X 14u 0 &data__->IO.value.X", "io.Y 14u 0 &data__->IO.value.Y",
                          "io.MODE 4u 0 &data__->IO.value.MODE", "tmp 11u 0 &data__->TMP.value"));
  EXPECT_THAT(made.text, HasSubstr("  INT SUM = 0;\n\n  void* const plchost_locals_[] = {&X, &CALLS, "));
  EXPECT_THAT(made.text, HasSubstr("  PLC_ENTER_LOCALS(plchost_pou_0, 0, plchost_locals_, 0u);\n"
                                   "  // Control execution\n"));
  EXPECT_THAT(made.text, HasSubstr("PART *data__) {\n  void* const plchost_locals_[] = {&data__->IO"));
}

TEST(TheCodeWithoutDirectives, HasTheLinesOfItsStatementsInComments) {
  const std::string code =
      without_directives("\nvoid A_body__(A *data__) {\n#line 7 \"joined.st\"\n  x;\n  y;\n}\nz;\n");
  EXPECT_THAT(code, Not(HasSubstr("#line")));
  EXPECT_EQ(line_in(code, 4), "  x;");
  EXPECT_EQ(line_in(code, 100), "");
  EXPECT_EQ(joined_line_of(code, 2), 0U);
  EXPECT_EQ(joined_line_of(code, 4), 7U);
  EXPECT_EQ(joined_line_of(code, 5), 7U);
  EXPECT_EQ(joined_line_of(code, 7), 0U) << "behind the body";
}

}  // namespace
}  // namespace plchost::matiec
