#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <gtest/gtest.h>

#include "instances/adapters/strucpp/line_directives.hpp"
#include "instances/adapters/strucpp/temporaries.hpp"

namespace plchost::strucpp {
namespace {

iec::Variable temporary(const std::string& name, const std::string& member) {
  iec::Variable variable{.name = name, .type = "INT", .location = "", .place = {}};
  variable.section = iec::Variable::Section::temporary;
  variable.member = member;
  return variable;
}

TEST(TemporariesOfStrucpp, HaveTheirInitialValuesInEachCall) {
  iec::Project project;
  iec::Variable constant = temporary("k", "K");
  constant.constant = true;
  iec::Variable kept = temporary("n", "N");
  kept.section = iec::Variable::Section::local;
  project.add(
      {.name = "Counter",
       .variables = {temporary("a", "A"), temporary("text", "TEXT"), temporary("none", ""), constant, kept},
       .chart = "",
       .place = {}});
  project.add({.name = "Main", .variables = {temporary("b", "B_")}, .chart = "", .place = {}});
  EXPECT_EQ(
      with_new_temporaries("COUNTER::COUNTER()\n    : N(F(1, 2)), TEXT(\")\\\", x(\"), A(5)\n{\n}\n"
                           "void COUNTER::operator()() {\n    A = 1;\n}\nvoid Program_MAIN::run() {\n}\n"
                           "void COUNTER::RESET() {\n}\nvoid OTHER::run() {\n}",
                           project),
      "COUNTER::COUNTER()\n    : N(F(1, 2)), TEXT(\")\\\", x(\"), A(5)\n{\n}\n"
      "void COUNTER::operator()() { plchost_renew(A, 5); plchost_renew(TEXT, \")\\\", x(\");\n    A = 1;\n}\n"
      "void Program_MAIN::run() { plchost_renew(B_);\n}\nvoid COUNTER::RESET() {\n}\nvoid OTHER::run() {\n}");
}

TEST(TemporariesOfStrucpp, OfDamagedCodeAreLeftToTheCompiler) {
  iec::Project project;
  project.add({.name = "A", .variables = {temporary("b", "B")}, .chart = "", .place = {}});
  for (const std::string code :
       {"", "\n", "A::A()", "A::A()\n    : B(", "A::A()\n    : ", "::\n", "void ::run() {"})
    EXPECT_EQ(with_new_temporaries(code, project), code);
}

TEST(LinesOfStrucpp, NameTheFileOfTheirPou) {
  const auto find = [](std::string_view pou) -> std::optional<std::string> {
    const std::map<std::string_view, std::string> files{
        {"A", "a.st"}, {"MAIN", "main.st"}, {"TWICE", "t.st"}};
    const auto found = files.find(pou);
    return found == files.end() ? std::nullopt : std::optional(found->second);
  };
  EXPECT_EQ(with_files_of_pous(
                "#line 1 \"a.st\"\nint x;\n#line 5 \"a.st\"\nclass Program_MAIN : public Base {\n"
                "#line 6 \"a.st\"\n    A B;\n};\n#line 2 \"a.st\"\nvoid A::operator()() {\n"
                "#line 3 \"a.st\"\n#line 4 \"a.st\"\n}\n#line 1 \"a.st\"\nIEC_INT TWICE(IEC_INT X) {\n}\n"
                "#line 9 \"a.st\"\nvoid Configuration_C::run() {\n#line 8 \"a.st\"",
                find),
            "#line 1 \"a.st\"\nint x;\n#line 5 \"main.st\"\nclass Program_MAIN : public Base {\n"
            "#line 6 \"main.st\"\n    A B;\n};\n#line 2 \"a.st\"\nvoid A::operator()() {\n"
            "#line 3 \"a.st\"\n#line 4 \"a.st\"\n}\n#line 1 \"t.st\"\nIEC_INT TWICE(IEC_INT X) {\n}\n"
            "#line 9 \"t.st\"\nvoid Configuration_C::run() {\n#line 8 \"a.st\"");
}

}  // namespace
}  // namespace plchost::strucpp
