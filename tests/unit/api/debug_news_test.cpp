// News in the states of a debugger.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "api/cli/debug/debug_state.hpp"

namespace plchost {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<std::string> texts(DebugNews& sut, const json& state) {
  std::vector<std::string> all;
  for (const DebugNews::Line& line : sut.lines(state)) all.push_back(line.text);
  return all;
}
json line(int number) {
  return {{"number", number}, {"text", "line " + std::to_string(number)}};
}

TEST(DebugNews, TellsEachLineOnce) {
  DebugNews sut;
  EXPECT_THAT(texts(sut, {{"log", {line(1), line(2)}}, {"logged", 2}}), ElementsAre("line 1", "line 2"));
  EXPECT_THAT(texts(sut, {{"log", {line(1), line(2), line(3)}}, {"logged", 3}}), ElementsAre("line 3"));
  EXPECT_THAT(texts(sut, {{"log", {line(3)}}, {"logged", 3}}), IsEmpty());
}

TEST(DebugNews, TellsLinesThatAreMissingAtTheBeginInTheMiddleAndAtTheEnd) {
  DebugNews sut;
  EXPECT_THAT(texts(sut, {{"log", {line(4), line(7)}}, {"logged", 9}}),
              ElementsAre("3 lines of log points are missing here: too many came at once", "line 4",
                          "2 lines of log points are missing here: too many came at once", "line 7",
                          "2 lines of log points are missing here: too many came at once"));
  EXPECT_THAT(texts(sut, {{"log", {line(7)}}, {"logged", 9}}), IsEmpty());
}

}  // namespace
}  // namespace plchost
