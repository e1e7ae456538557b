#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/adapters/strucpp/source_text.hpp"

namespace plchost::strucpp {
namespace {

using ::testing::ElementsAre;
using ::testing::FieldsAre;
using ::testing::IsEmpty;

SourceText text_of(const std::string& text) {
  const std::vector<iec::Source> sources{{"line.st", text}};
  return text_for_strucpp(sources.front(), enumerations_in(sources), constants_in(sources));
}

TEST(SourceTextForStrucpp, HasValuesOfEnumerationsBehindADot) {
  const std::string type = "TYPE Mode : (idle, busy); Size : INT; END_TYPE\n";
  EXPECT_EQ(text_of(type + "m := Mode#busy; s := Size#5; t := T#5s; c := 'Mode#busy'; (* Mode#busy *)").text,
            type + "m := Mode.busy; s := Size#5; t := T#5s; c := 'Mode#busy'; (* Mode#busy *)");
  EXPECT_EQ(text_of(type + "PROGRAM p VAR m : Mode := MODE#idle; END_VAR END_PROGRAM").text,
            type + "PROGRAM p VAR m : Mode := MODE.idle; END_VAR END_PROGRAM");
}

TEST(SourceTextForStrucpp, HasTheGlobalsOfItsOnlyResourceInItsConfiguration) {
  const SourceText made = text_of(
      "CONFIGURATION c\nRESOURCE r ON\nPLC VAR_GLOBAL a : INT; END_VAR\nVAR_GLOBAL CONSTANT b : INT; "
      "END_VAR\n"
      "TASK t (INTERVAL := T#1s); END_RESOURCE\nEND_CONFIGURATION");
  EXPECT_EQ(
      made.text,
      "CONFIGURATION c\n             \n    VAR_GLOBAL a : INT; END_VAR\nVAR_GLOBAL CONSTANT b : INT; END_VAR "
      "RESOURCE r ON PLC\nTASK t (INTERVAL := T#1s); END_RESOURCE\nEND_CONFIGURATION");
  EXPECT_THAT(made.inserted, ElementsAre(FieldsAre(4U, 37U, 18U)));
}

TEST(SourceTextForStrucpp, HasNoLocationsOfSeveralNumbersInItsGlobals) {
  const SourceText made = text_of(
      "CONFIGURATION c\nVAR_GLOBAL RETAIN a AT %IX0.1.2 : BOOL; b AT %QW0 : INT;\n"
      "c, d AT %qw0.1 : INT; END_VAR\nEND_CONFIGURATION");
  EXPECT_EQ(made.text,
            "CONFIGURATION c\nVAR_GLOBAL RETAIN a             : BOOL; b AT %QW0 : INT;\n"
            "c, d           : INT; END_VAR\nEND_CONFIGURATION");
  EXPECT_THAT(made.places, ElementsAre(FieldsAre(2U, "A", "%IX0.1.2"), FieldsAre(3U, "C", "%QW0.1")));
}

TEST(SourceTextForStrucpp, HasTheResourcesAsTheyAreIfThereAreSeveralOrTheyHaveNoGlobals) {
  for (const std::string text :
       {"CONFIGURATION c RESOURCE r ON PLC VAR_GLOBAL a : INT; END_VAR END_RESOURCE RESOURCE s ON PLC "
        "END_RESOURCE END_CONFIGURATION",
        "CONFIGURATION c RESOURCE r ON PLC TASK t (PRIORITY := 1); END_RESOURCE END_CONFIGURATION",
        "CONFIGURATION c RESOURCE r ON PLC VAR_GLOBAL a : INT;", "CONFIGURATION c RESOURCE", "RESOURCE"}) {
    EXPECT_EQ(text_of(text).text, text);
    EXPECT_THAT(text_of(text).inserted, IsEmpty());
  }
}

TEST(SourceTextForStrucpp, GivesExternalConstantsTheValueOfTheirGlobal) {
  const std::string globals =
      "TYPE Mode : (idle, busy); END_TYPE\nCONFIGURATION c VAR_GLOBAL CONSTANT a, b : INT := -5; m : Mode := "
      "Mode#busy; n : INT; END_VAR VAR_GLOBAL v : INT := 7; END_VAR END_CONFIGURATION\n";
  const SourceText made = text_of(
      "PROGRAM p\nVAR_EXTERNAL CONSTANT A : INT; m : Mode;\n  b : INT := 1; n : INT; "
      "v : INT; END_VAR VAR_EXTERNAL a : INT; END_VAR END_PROGRAM\n" +
      globals);
  EXPECT_TRUE(
      made.text.starts_with("PROGRAM p\nVAR_EXTERNAL CONSTANT A : INT := - 5; m : Mode := Mode.busy;\n  "
                            "b : INT := 1; n : INT; v : INT; "
                            "END_VAR VAR_EXTERNAL a : INT; END_VAR END_PROGRAM\n"))
      << made.text;
  EXPECT_THAT(made.inserted, ElementsAre(FieldsAre(2U, 30U, 7U), FieldsAre(2U, 40U, 13U)));
  for (const std::string text :
       {"VAR_EXTERNAL CONSTANT",
        "VAR_EXTERNAL CONSTANT a, b : INT; END_VAR VAR_GLOBAL CONSTANT a, b : INT := 5; END_VAR",
        "VAR_EXTERNAL CONSTANT a : INT", "VAR_GLOBAL CONSTANT a :=", "VAR_GLOBAL CONSTANT ,, : ;:= ;",
        "VAR_EXTERNAL CONSTANT ; END_VAR"}) {
    EXPECT_EQ(text_of(text).text, text);
  }
}

TEST(SourceTextForStrucpp, HidesThePlacesOfPrograms) {
  const SourceText made = text_of(
      "PROGRAM p\nVAR RETAIN\n  a, b AT %mw1 : INT; c AT %QX0.1 : BOOL;\nEND_VAR\nVAR at : INT; d AT %I* : "
      "INT; END_VAR\n"
      "END_PROGRAM\nCONFIGURATION c VAR_GLOBAL e AT %QB1 : BYTE; END_VAR END_CONFIGURATION");
  EXPECT_EQ(made.text,
            "PROGRAM p\nVAR RETAIN\n  a, b         : INT; c           : BOOL;\nEND_VAR\nVAR at : INT; d AT "
            "%I* : INT; "
            "END_VAR\nEND_PROGRAM\nCONFIGURATION c VAR_GLOBAL e AT %QB1 : BYTE; END_VAR END_CONFIGURATION");
  EXPECT_THAT(made.places, ElementsAre(FieldsAre(3U, "A", "%MW1"), FieldsAre(3U, "C", "%QX0.1")));
}

TEST(SourceTextForStrucpp, LeavesPlacesThatAreNotToldApart) {
  const std::string text =
      "PROGRAM p VAR a AT %IX0.0 : BOOL; END_VAR END_PROGRAM PROGRAM q VAR a AT %IX0.1 : BOOL; END_VAR "
      "END_PROGRAM";
  EXPECT_EQ(text_of(text).text, text);
  EXPECT_THAT(text_of(text).places, IsEmpty());
}

}  // namespace
}  // namespace plchost::strucpp
