// Types of variables in the words that the adapter for MATIEC goes on with.
#include <span>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "instances/adapters/matiec/constant_bounds.hpp"
#include "instances/adapters/matiec/iec2c.hpp"
#include "instances/adapters/matiec/references.hpp"
#include "tests/unit/adapters/problem_texts.hpp"

namespace plchost::matiec {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

iec::Project project_of(const std::string& text) {
  const std::vector<iec::Source> sources{{"a.st", text}};
  return iec::read_project(sources).project;
}
std::vector<std::string> types_of(const std::vector<iec::Variable>& variables) {
  std::vector<std::string> types;
  for (const iec::Variable& variable : variables) types.push_back(variable.type);
  return types;
}

TEST(BoundsByMatiec, AreTheNumbersOfTheirConstants) {
  iec::Project project = project_of(R"(
PROGRAM Main
  VAR CONSTANT low : INT := -2; high : UINT := UINT#16#1_0; last : INT := high; text : STRING := 'a'; END_VAR
  VAR i : INT := 3; END_VAR
  VAR a : ARRAY[low..High] OF INT; b : ARRAY[0..1, 1..last] OF ARRAY[1 .. glob] OF INT; END_VAR
  VAR c : ARRAY[1..i] OF INT; d : ARRAY[1..other] OF INT; e : ARRAY[1..text] OF INT; END_VAR
  VAR_EXTERNAL CONSTANT glob : INT; END_VAR
END_PROGRAM
FUNCTION_BLOCK Fb VAR a : ARRAY[1..glob] OF INT; END_VAR END_FUNCTION_BLOCK
CONFIGURATION c VAR_GLOBAL CONSTANT glob : INT := 5; END_VAR
VAR_GLOBAL all : ARRAY[0..glob] OF BOOL; END_VAR END_CONFIGURATION)");
  resolve_bounds(project);
  EXPECT_THAT(types_of(project.pous[0].variables),
              ElementsAre("INT", "UINT", "INT", "STRING", "INT", "ARRAY[-2..16] OF INT",
                          "ARRAY[0..1, 1..16] OF ARRAY[1..5] OF INT", "ARRAY[1..i] OF INT",
                          "ARRAY[1..other] OF INT", "ARRAY[1..text] OF INT", "INT"));
  EXPECT_THAT(types_of(project.pous[1].variables), ElementsAre("ARRAY[1..glob] OF INT"))
      << "it does not declare the global";
  EXPECT_THAT(types_of(project.configurations[0].globals), ElementsAre("INT", "ARRAY[0..5] OF BOOL"));
}

TEST(BoundsByMatiec, AreNoneOfConstantsThatDiffer) {
  iec::Project project = project_of(R"(
PROGRAM Main VAR_EXTERNAL CONSTANT n : INT; END_VAR VAR a : ARRAY[1..n] OF INT; END_VAR END_PROGRAM
CONFIGURATION c
RESOURCE one ON PLC VAR_GLOBAL CONSTANT n : INT := 1; END_VAR END_RESOURCE
RESOURCE two ON PLC VAR_GLOBAL CONSTANT n : INT := 2; END_VAR END_RESOURCE
END_CONFIGURATION)");
  resolve_bounds(project);
  EXPECT_THAT(types_of(project.pous[0].variables), ElementsAre("INT", "ARRAY[1..n] OF INT"));
}

TEST(ReferencesByMatiec, AreMarkedAlsoInOtherTypes) {
  iec::Project project = project_of(R"(
TYPE Chain : ARRAY[1..2] OF Node; Place : REF_TO INT; Node : STRUCT next : REF_TO Node; END_STRUCT;
  Plain : STRUCT x : INT; END_STRUCT; END_TYPE
PROGRAM Main VAR a : REF_TO INT; b : place; c : Chain; d : Plain; e : ARRAY[1..2] OF Place; f : INT;
END_VAR END_PROGRAM
CONFIGURATION c VAR_GLOBAL g : Node; h : Plain; END_VAR END_CONFIGURATION)");
  mark_references(project);
  EXPECT_THAT(types_of(project.pous[0].variables),
              ElementsAre("REFERENCE REF_TO INT", "REFERENCE place", "REFERENCE Chain", "Plain",
                          "REFERENCE ARRAY[1..2] OF Place", "INT"));
  EXPECT_THAT(types_of(project.configurations[0].globals), ElementsAre("REFERENCE Node", "Plain"));
}

TEST(ReferencesByMatiec, AreFoundWhereTheFirstOneStands) {
  const std::vector<iec::Source> sources{{"a.st", "(* REF_TO *) PROGRAM Main"},
                                         {"b.st", "TYPE a :\n ref_to INT;"}};
  EXPECT_EQ(first_reference(sources), (iec::SourcePlace{"b.st", 2, 2}));
  EXPECT_EQ(first_reference(std::span(sources).first(1)).file, "");
}

TEST(ReferencesByMatiec, ToFunctionBlocksAreToldWhereTheyStand) {
  const std::vector<iec::Source> sources{
      {"a.st",
       "FUNCTION_BLOCK Pump VAR a : INT; END_VAR END_FUNCTION_BLOCK\n"
       "PROGRAM Main VAR a : REF_TO INT;\n b : REF_TO pump; c : REF_TO Ton; END_VAR END_PROGRAM"}};
  const auto told = texts(references_to_blocks(iec::read_project(sources).project, sources,
                                               [](const std::string& name) { return name == "TON"; }));
  EXPECT_THAT(told, ElementsAre(HasSubstr("a.st:3:6: REF_TO pump: iec2c cannot translate references"),
                                HasSubstr("a.st:3:23: REF_TO Ton: ")));
}

TEST(ReferencesByMatiec, AreFollowedInAssignments) {
  EXPECT_EQ(
      with_reference_assignments("  __SET_VAR(data__->,(*KEPT),(*),((*__GET_VAR(data__->KEPT,)) + 1));\n"
                                 "  __SET_EXTERNAL(data__->,(*MANY),(*.table[(2) - (1)]),F(\n1, 2));\n"
                                 "  __SET_VAR(data__->,(*ONE.P),(*),4);__SET_VAR(data__->,I,,(*P));\n"),
      "  PLCHOST_SET_REFERENCE(__GET_VAR(data__->KEPT,),((*__GET_VAR(data__->KEPT,)) + 1));\n"
      "  PLCHOST_SET_REFERENCE(__GET_EXTERNAL(data__->MANY,.table[(2) - (1)]),F(\n1, 2));\n"
      "  PLCHOST_SET_REFERENCE(__GET_VAR(data__->ONE.P,),4);__SET_VAR(data__->,I,,(*P));\n");
  for (const char* const code : {"__SET_", "__SET_VAR(", "__SET_VAR(a,(*", "__SET_VAR(a,(*B)",
                                 "__SET_VAR(a,(*B),(*", "__SET_VAR(a,(*B),(*c", "__SET_VAR(,(*B),1)", ""})
    EXPECT_EQ(with_reference_assignments(code), code);
}

TEST(OptionsOfIec2c, AreThoseThatItsHelpTells) {
  constexpr const char* kHelp =
      "\nsyntax: iec2c [<options>]\n -h : show this help message\n -r : allow use of references (REF_TO, -R "
      ": )\n"
      " -a : allow use of non-literals in array size limits\n";
  EXPECT_THAT(known_options(kHelp, "rRa"), ElementsAre("-r", "-a"));
  EXPECT_THAT(known_options("", "a"), ElementsAre());
}

}  // namespace
}  // namespace plchost::matiec
