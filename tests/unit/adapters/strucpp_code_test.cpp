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

TEST(TemporariesOfStrucpp, OfAProgramWithExternalVariablesHaveTheirInitialValues) {
  iec::Project project;
  project.add({.name = "Main", .variables = {temporary("n", "N")}, .chart = "", .place = {}});
  const std::string constructor =
      "Program_MAIN::Program_MAIN(GlobalVar<IEC_INT>* G_ref, GlobalVar<IEC_STRING>* H_ref)\n"
      "    : N(5), G(G_ref), H(H_ref)\n{\n}\n";
  EXPECT_EQ(with_new_temporaries(constructor + "void Program_MAIN::run() {\n    G->write(N);\n}\n", project),
            constructor + "void Program_MAIN::run() { plchost_renew(N, 5);\n    G->write(N);\n}\n");
}

TEST(TemporariesOfStrucpp, ThatAreArraysHaveAllInitialValues) {
  iec::Project project;
  project.add(
      {.name = "Counter", .variables = {temporary("a", "A"), temporary("n", "N")}, .chart = "", .place = {}});
  const std::string constructor = "COUNTER::COUNTER()\n    : A({1, F(2, 3), 4}), N(5)\n{\n}\n";
  EXPECT_EQ(with_new_temporaries(constructor + "void COUNTER::operator()() {\n}\n", project),
            constructor +
                "void COUNTER::operator()() { plchost_renew(A, {1, F(2, 3), 4}); plchost_renew(N, 5);"
                "\n}\n");
}

TEST(TemporariesOfStrucpp, HaveNoInitialValuesOfALaterPou) {
  iec::Project project;
  for (const char* const name : {"First", "Second"})
    project.add({.name = name, .variables = {temporary("n", "N")}, .chart = "", .place = {}});
  const std::string first = "Program_FIRST::Program_FIRST()\n{\n}\n\n";
  const std::string second = "Program_SECOND::Program_SECOND()\n    : N(5)\n{\n}\n\n";
  const std::string first_body = "void Program_FIRST::run() {";
  const std::string second_body = "void Program_SECOND::run() {";
  const std::string end = "\n}\n";
  EXPECT_EQ(
      with_new_temporaries(first + first_body + end + second + second_body + end, project),
      first + first_body + " plchost_renew(N);" + end + second + second_body + " plchost_renew(N, 5);" + end);
  const std::string straight = "Program_FIRST::Program_FIRST()\n" + second;
  EXPECT_EQ(with_new_temporaries(straight + first_body + end, project),
            straight + first_body + " plchost_renew(N);" + end)
      << "also without a body";
}

TEST(TemporariesOfStrucpp, OfDamagedCodeAreLeftToTheCompiler) {
  iec::Project project;
  project.add({.name = "A", .variables = {temporary("b", "B")}, .chart = "", .place = {}});
  for (const std::string code :
       {"", "\n", "A::A()", "A::A()\n    : B(", "A::A()\n    : ", "A::A(", "A::A)", "::\n", "void ::run() {"})
    EXPECT_EQ(with_new_temporaries(code, project), code);
}

unsigned same_line(std::string_view /*file*/, unsigned line) {
  return line;
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
                find, same_line),
            "#line 1 \"a.st\"\nint x;\n#line 5 \"main.st\"\nclass Program_MAIN : public Base {\n"
            "#line 6 \"main.st\"\n    A B;\n};\n#line 2 \"a.st\"\nvoid A::operator()() {\n"
            "#line 3 \"a.st\"\n#line 4 \"a.st\"\n}\n#line 1 \"t.st\"\nIEC_INT TWICE(IEC_INT X) {\n}\n"
            "#line 9 \"t.st\"\nvoid Configuration_C::run() {\n#line 8 \"a.st\"");
}

TEST(LinesOfStrucpp, NameTheFileOfADeclaredFunction) {
  const auto find = [](std::string_view pou) -> std::optional<std::string> {
    return pou == "TWICE" ? std::optional<std::string>("t.st") : std::nullopt;
  };
  EXPECT_EQ(with_files_of_pous("#line 1 \"a.st\"\nIEC_INT TWICE(IEC_INT X);\n", find, same_line),
            "#line 1 \"t.st\"\nIEC_INT TWICE(IEC_INT X);\n");
}

TEST(LinesOfStrucpp, AreThoseOfTheUsersFile) {
  const auto find = [](std::string_view pou) -> std::optional<std::string> {
    return pou == "TWICE" ? std::optional<std::string>("a.xml") : std::nullopt;
  };
  const auto in_xml = [](std::string_view file, unsigned line) { return file == "a.xml" ? line + 20 : line; };
  EXPECT_EQ(with_files_of_pous("#line 1 \"a.xml\"\nstruct P;\n#line 2 \"b.st\"\nIEC_INT TWICE(IEC_INT X) {\n"
                               "#line 3 \"b.st\"\n}\n#line x\n#line 4 \"b.st\"",
                               find, in_xml),
            "#line 21 \"a.xml\"\nstruct P;\n#line 22 \"a.xml\"\nIEC_INT TWICE(IEC_INT X) {\n"
            "#line 23 \"a.xml\"\n}\n#line x\n#line 4 \"b.st\"");
}

}  // namespace
}  // namespace plchost::strucpp
