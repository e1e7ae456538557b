// The answers to a client of the Debug Adapter Protocol.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "shm/base/names.hpp"
#include "tests/unit/api/dap_client.hpp"

namespace plchost {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST_F(DapSessionTest, TellsTheFramesThatItsClientAsksFor) {
  const auto frames = [&](int first, int levels) {
    const json body = ask("stackTrace", {{"threadId", 1}, {"startFrame", first}, {"levels", levels}});
    EXPECT_EQ(body["totalFrames"], 3);
    std::vector<int> ids;
    for (const json& frame : body["stackFrames"]) ids.push_back(frame["id"]);
    return ids;
  };
  EXPECT_THAT(frames(0, 20), ElementsAre(kInnermost, kInnermost + 1, kCaller));
  EXPECT_THAT(frames(0, 0), ElementsAre(kInnermost, kInnermost + 1, kCaller)) << "all";
  EXPECT_THAT(frames(0, 1), ElementsAre(kInnermost));
  EXPECT_THAT(frames(1, 1), ElementsAre(kInnermost + 1));
  EXPECT_THAT(frames(2, 20), ElementsAre(kCaller));
  EXPECT_THAT(frames(3, 20), IsEmpty());
  EXPECT_THAT(frames(-1, -1), ElementsAre(kInnermost, kInnermost + 1, kCaller));
}

TEST_F(DapSessionTest, ShowsASourceByThePathThatItsClientHasForIt) {
  const auto shown_path = [&] {
    return ask("stackTrace", {{"threadId", 1}})["stackFrames"][0]["source"]["path"];
  };
  EXPECT_EQ(shown_path(), "a.st") << "as it was built";
  (void)ask("setBreakpoints", {{"source", {{"path", "/src/b.st"}}}, {"breakpoints", json::array()}});
  (void)ask("setBreakpoints", {{"source", {{"name", "a.st"}}}, {"breakpoints", json::array()}});
  EXPECT_EQ(shown_path(), "a.st");
  (void)ask("setBreakpoints", {{"source", {{"path", "/src/a.st"}}}, {"breakpoints", json::array()}});
  EXPECT_EQ(shown_path(), "/src/a.st") << "an editor opens only a whole path";
}

class DapSources : public DapSessionTest {
 protected:
  DapSources() {
    instance_.halt("fast", 1,
                   json::array({{{"pou", "Cap"}, {"line", 2}, {"file", "b/same.st"}},
                                {{"pou", "Fill"}, {"line", 2}, {"file", "a/same.st"}}}));
  }
  void set(const std::string& path, const json& breakpoint) {
    (void)ask("setBreakpoints", {{"source", {{"path", path}}}, {"breakpoints", json::array({breakpoint})}});
  }
  std::vector<std::string> paths() {
    std::vector<std::string> all;
    const json body = ask("stackTrace", {{"threadId", 1}});
    for (const json& frame : body["stackFrames"]) all.push_back(frame["source"]["path"]);
    return all;
  }
};

TEST_F(DapSources, OfOneNameAreToldApartByTheirWholePaths) {
  set("/src/b/same.st", {{"line", 2}});
  EXPECT_THAT(instance_.commands, ElementsAre("break /src/b/same.st:2"));
  set("/src/a/same.st", {{"line", 2}});
  EXPECT_THAT(paths(), ElementsAre("/src/b/same.st", "/src/a/same.st"));
}

TEST_F(DapSources, AreThoseInWhichTheInstanceSetsTheirBreakpoints) {
  instance_.file = "b/same.st";
  set("/moved/same.st", {{"line", 2}});
  EXPECT_THAT(paths(), ElementsAre("/moved/same.st", "a/same.st"));
}

TEST_F(DapSources, WithLongPathsAreAskedForByTheLastParts) {
  const std::string folder(kMaxArgument - 300, 'f');
  set("/" + folder + "/b/same.st",
      {{"line", 2}, {"logMessage", std::string(200, 'x')}, {"condition", std::string(200, 'y')}});
  EXPECT_THAT(instance_.commands.back(), testing::StartsWith("break /b/same.st:2 if y"));
}

TEST_F(DapSources, WithBlanksInTheirNamesStandInQuotationMarks) {
  set("/my src/a log b.st", {{"line", 2}, {"condition", "n > 5"}});
  EXPECT_THAT(instance_.commands, ElementsAre(R"(break "/my src/a log b.st":2 if n > 5)"));
  for (const char* const path : {"/src/a\" log b.st", "/src/a\nb.st"}) {
    const json one = ask("setBreakpoints", {{"source", {{"path", path}}},
                                            {"breakpoints", json::array({{{"line", 7}}})}})["breakpoints"][0];
    EXPECT_FALSE(one["verified"]) << path;
    EXPECT_THAT(one["message"], HasSubstr("is no name of a file")) << path;
  }
  EXPECT_EQ(instance_.commands.size(), 1U);
}

TEST_F(DapSources, OfOtherSystemsAreAskedForByTheirNames) {
  set("C:\\src\\same.st", {{"line", 2}});
  EXPECT_THAT(instance_.commands, ElementsAre("break same.st:2"));
}

TEST_F(DapSessionTest, KeepsBreakpointsThatTheInstanceDoesNotDelete) {
  const auto set = [&](const json& breakpoints) {
    return answer("setBreakpoints", {{"source", {{"path", "/src/a.st"}}}, {"breakpoints", breakpoints}});
  };
  EXPECT_TRUE(set(json::array({{{"line", 7}}}))["success"]);
  instance_.busy = true;
  EXPECT_FALSE(set(json::array())["success"]) << "the client must not believe that they are gone";
  instance_.busy = false;
  EXPECT_TRUE(set(json::array())["success"]);
  EXPECT_EQ(instance_.commands.back(), "delete 1");
}

TEST_F(DapSessionTest, TellsThatATaskGoesOnWhichItsClientHasNotLetGo) {
  sent_.clear();
  ASSERT_TRUE(sut_.look());
  ASSERT_EQ(sent_.size(), 1U);
  EXPECT_EQ(sent_[0]["event"], "stopped");
  sent_.clear();
  instance_.tasks[0]["state"] = "runs";  // as after a change of the scheduler
  ASSERT_TRUE(sut_.look());
  ASSERT_EQ(sent_.size(), 1U);
  EXPECT_EQ(sent_[0]["event"], "continued");
  EXPECT_EQ(sent_[0]["body"]["threadId"], 1);
  sent_.clear();
  ASSERT_TRUE(sut_.look());
  EXPECT_THAT(sent_, IsEmpty()) << "once";
}

TEST_F(DapSessionTest, TellsItsClientNothingOfATaskThatItHasLetGoItself) {
  ASSERT_TRUE(sut_.look());
  (void)ask("continue", {{"threadId", 1}});
  instance_.tasks[0]["state"] = "runs";
  sent_.clear();
  ASSERT_TRUE(sut_.look());
  EXPECT_THAT(sent_, IsEmpty());
}

TEST_F(DapSessionTest, TellsOfBreakpointsThatAnotherVersionOfTheApplicationMovesOrDoesNotHave) {
  ASSERT_TRUE(sut_.look());
  instance_.breakpoints = json::array({{{"id", 1}, {"line", 7}}});
  (void)ask("setFunctionBreakpoints", {{"breakpoints", json::array({{{"name", "Main"}}})}});
  const auto news = [&] {
    sent_.clear();
    EXPECT_TRUE(sut_.look());
    return sent_;
  };
  EXPECT_THAT(news(), IsEmpty());
  instance_.breakpoints[0]["line"] = 9;
  auto told = news();
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0]["event"], "breakpoint");
  EXPECT_EQ(told[0]["body"]["reason"], "changed");
  EXPECT_EQ(told[0]["body"]["breakpoint"], (json{{"id", 1}, {"verified", true}, {"line", 9}}));
  instance_.breakpoints = json();
  EXPECT_THAT(news(), IsEmpty()) << "the state is too long to tell them";
  instance_.breakpoints = json::array();
  told = news();
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0]["body"]["breakpoint"]["verified"], false);
  EXPECT_THAT(told[0]["body"]["breakpoint"]["message"], HasSubstr("gone"));
  EXPECT_THAT(news(), IsEmpty()) << "once";
}

TEST_F(DapSessionTest, TellsNothingOfBreakpointsThatItsClientDeletes) {
  ASSERT_TRUE(sut_.look());
  (void)ask("setFunctionBreakpoints", {{"breakpoints", json::array({{{"name", "Main"}}})}});
  (void)ask("setFunctionBreakpoints", {{"breakpoints", json::array()}});
  instance_.breakpoints = json::array();
  sent_.clear();
  ASSERT_TRUE(sut_.look());
  EXPECT_THAT(sent_, IsEmpty());
}

TEST_F(DapSessionTest, TellsOfTasksThatIgnoreBreakpointsUnderAnotherScheduler) {
  ASSERT_TRUE(sut_.look());
  const auto news = [&](const std::string& state) {
    instance_.tasks[1]["state"] = state;
    sent_.clear();
    EXPECT_TRUE(sut_.look());
    return sent_;
  };
  instance_.tasks.push_back({{"task", "edge"}});
  EXPECT_THAT(news("runs"), IsEmpty());
  EXPECT_THAT(news("stopped"), IsEmpty());
  const auto told = news("ignored");
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0]["event"], "output");
  EXPECT_THAT(told[0]["body"]["output"], HasSubstr("edge"));
  EXPECT_THAT(news("stopped"), IsEmpty());
  EXPECT_THAT(news("ignored"), IsEmpty()) << "once";
  EXPECT_THAT(news("runs"), IsEmpty());
  EXPECT_EQ(news("ignored").size(), 1U);
}

TEST_F(DapSessionTest, TellsWhyATaskIsNotPaused) {
  instance_.remark = "breakpoints are ignored in tasks of external events";
  EXPECT_TRUE(answer("pause", {{"threadId", 1}})["success"]) << "it halts";
  instance_.tasks[0]["state"] = "ignored";
  const json response = answer("pause", {{"threadId", 1}});
  EXPECT_FALSE(response["success"]) << "its client would wait for a halt";
  EXPECT_EQ(response.value("message", ""), instance_.remark);
}

TEST_F(DapSessionTest, LetsOneTaskGoOnIfEachHaltsByItself) {
  instance_.halt("slow", 1, json::array());
  EXPECT_EQ(ask("continue", {{"threadId", 1}})["allThreadsContinued"], false);
  (void)ask("next", {{"threadId", 1}});
  EXPECT_THAT(instance_.commands, ElementsAre("continue fast", "next fast"));
}

TEST_F(DapSessionTest, LetsAllTasksGoOnIfTheyHaltTogether) {
  EXPECT_FALSE(sut_.obey({{"seq", 1}, {"command", "disconnect"}}));
  instance_.halt("slow", 1, json::array());
  instance_.tasks.push_back({{"task", "edge"}, {"state", "runs"}});
  (void)ask("attach", {{"haltAllTasks", true}});
  instance_.commands.clear();
  EXPECT_EQ(ask("continue", {{"threadId", 1}})["allThreadsContinued"], true);
  EXPECT_EQ(ask("continue", {{"threadId", 1}, {"singleThread", true}})["allThreadsContinued"], false);
  (void)ask("next", {{"threadId", 1}});
  (void)ask("stepIn", {{"threadId", 2}, {"singleThread", true}});
  EXPECT_THAT(instance_.commands,
              ElementsAre("continue *", "continue fast", "continue slow", "next fast", "step slow"));
}

TEST_F(DapSessionTest, LetsNoOtherTaskGoOnForAStepOfATaskThatDoesNotHalt) {
  EXPECT_FALSE(sut_.obey({{"seq", 1}, {"command", "disconnect"}}));
  instance_.halt("slow", 1, json::array());
  (void)ask("attach", {{"haltAllTasks", true}});
  instance_.commands.clear();
  instance_.tasks[0]["state"] = "runs";
  for (const char* const step : {"next", "stepIn", "stepOut"}) {
    const json response = answer(step, {{"threadId", 1}});
    EXPECT_FALSE(response["success"]) << step;
    EXPECT_THAT(response.value("message", ""), HasSubstr("task 'fast' does not halt")) << step;
  }
  EXPECT_THAT(instance_.commands, IsEmpty());
}

TEST_F(DapSessionTest, IsAttachedOnce) {
  const json response = answer("attach");
  EXPECT_FALSE(response["success"]);
  EXPECT_EQ(response.value("message", ""), "attached already");
}

TEST_F(DapSessionTest, SetsFunctionBreakpointsByTheirNames) {
  const json wanted = {{"breakpoints", json::array({{{"name", " Main "}, {"condition", "n > 5"}}})}};
  EXPECT_TRUE(ask("setFunctionBreakpoints", wanted)["breakpoints"][0]["verified"]);
  EXPECT_THAT(instance_.commands, ElementsAre("break Main if n > 5"));
}

TEST_F(DapSessionTest, SetsBreakpointsWithCountsConditionsAndTexts) {
  const json one = {
      {"line", 7}, {"hitCondition", "=3"}, {"condition", "n > 5"}, {"logMessage", "n is {n} if log"}};
  const json wanted = {{"source", {{"path", "/src/a.st"}}},
                       {"breakpoints", json::array({one, {{"line", 9}, {"hitCondition", "%2"}}})}};
  const json made = ask("setBreakpoints", wanted)["breakpoints"];
  EXPECT_TRUE(made[0]["verified"] && made[1]["verified"]) << made;
  EXPECT_THAT(instance_.commands, ElementsAre("break /src/a.st:7 hits =3 if n > 5 log n is {n} if log",
                                              "break /src/a.st:9 hits %2"));
}

TEST_F(DapSessionTest, LetsNoPlaceOfABreakpointHaveFurtherPartsOfTheCommand) {
  for (const char* const name :
       {"Main log x", "Main if n > 5", "Main hits =1", "Main\nlog", "", "two words"}) {
    const json one =
        ask("setFunctionBreakpoints", {{"breakpoints", json::array({{{"name", name}}})}})["breakpoints"][0];
    EXPECT_FALSE(one["verified"]) << name;
    EXPECT_THAT(one["message"], HasSubstr("is no name of a POU")) << name;
  }
  EXPECT_THAT(instance_.commands, IsEmpty());
}

}  // namespace
}  // namespace plchost
