// The news of a watch of variables.
#include "api/cli/verbs/variable_changes.hpp"

#include <initializer_list>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/api/debugged_instance.hpp"

namespace plchost {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

VariableListing sample_of(std::initializer_list<plc_VariableRecord> variables, bool consistent = true) {
  VariableListing sample;
  sample.consistent = consistent;
  sample.variables.assign(variables.begin(), variables.end());
  return sample;
}
std::vector<std::string> changed(VariableChanges& sut, const VariableListing& sample) {
  std::vector<std::string> names;
  for (const plc_VariableRecord* const variable : sut.look(sample).changed)
    names.emplace_back(dds::text_of(variable->name));
  return names;
}

TEST(VariableChanges, AreNewValuesAndForces) {
  VariableChanges sut;
  auto a = variable_record("a", "INT", "1");
  const auto b = variable_record("b", "INT", "2");
  EXPECT_THAT(changed(sut, sample_of({a, b})), ElementsAre("a", "b"));
  EXPECT_THAT(changed(sut, sample_of({a, b})), IsEmpty());
  a.forced = true;
  EXPECT_THAT(changed(sut, sample_of({a, b})), ElementsAre("a"));
  EXPECT_THAT(changed(sut, sample_of({a, variable_record("b", "INT", "3")})), ElementsAre("b"));
}

TEST(VariableChanges, TellOfVariablesThatAreGoneAndComeBack) {
  VariableChanges sut;
  const auto a = variable_record("a", "INT", "1");
  const auto b = variable_record("b", "INT", "2");
  EXPECT_THAT(sut.look(sample_of({a, b})).gone, IsEmpty());
  EXPECT_THAT(sut.look(sample_of({a})).gone, ElementsAre("b"));
  EXPECT_THAT(sut.look(sample_of({a})).gone, IsEmpty()) << "once";
  EXPECT_THAT(changed(sut, sample_of({a, b})), ElementsAre("b")) << "also with the value of before";
}

TEST(VariableChanges, TellOfTheFirstOfSeveralSamplesOfDifferentCycles) {
  VariableChanges sut;
  EXPECT_FALSE(sut.look(sample_of({})).is_first_torn);
  EXPECT_TRUE(sut.look(sample_of({}, false)).is_first_torn);
  EXPECT_FALSE(sut.look(sample_of({}, false)).is_first_torn);
  EXPECT_FALSE(sut.look(sample_of({})).is_first_torn);
  EXPECT_TRUE(sut.look(sample_of({}, false)).is_first_torn);
}

}  // namespace
}  // namespace plchost
