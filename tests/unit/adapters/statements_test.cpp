#include "instances/adapters/matiec/statements.hpp"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace plchost::matiec {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

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
  const DebugCode made = with_statements(kCode, JoinedSource(sources));
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
  EXPECT_THAT(made.text,
              HasSubstr("PLC_STATEMENT(3u);\n  if (__GET_VAR(data__->GO,)) {\nPLC_STATEMENT(2u);\n"));
  EXPECT_THAT(made.text, HasSubstr("void MAIN_init__(MAIN *data__, BOOL retain) {\n  __INIT_VAR"));
  EXPECT_THAT(made.text, HasSubstr("void EMPTY_body__(EMPTY *data__) {\n  return;\n"));
  EXPECT_THAT(made.text, Not(HasSubstr("#line")));
  const std::string header = iec::debug_header(made.pous);
  EXPECT_THAT(header, HasSubstr("plchost_lines_1[] = {2u, 3u};"));
  EXPECT_THAT(header, HasSubstr("\"MAIN\", \"b \\\"1\\\".st\", plchost_lines_1, 2u, 0u};"));
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
