// The commands of "plcctl debug".
#include "api/cli/debug/debug_console.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/api/debugged_instance.hpp"

namespace plchost {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class DebugConsoleTest : public testing::Test {
 protected:
  DebugConsoleTest() {
    (void)link_.attach(false);
    instance_.variables = {variable_record("n", "INT", "7"), variable_record("Main.n", "INT", "1"),
                           variable_record("Main.c.n", "INT", "2"), variable_record("x", "INT", "8"),
                           variable_record("Main.t[]", "ARRAY [1..2] OF INT", "[3, 4]")};
    instance_.halt("fast", 1, stack_);
  }

  std::string said(std::string_view line) {
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    EXPECT_TRUE(sut_.obey(line));
    const std::string errors = testing::internal::GetCapturedStderr();
    return testing::internal::GetCapturedStdout() + errors;
  }

  const json stack_ =
      json::array({{{"pou", "Counter"}, {"line", 9}, {"file", "a.st"}, {"instance", "Main.c"}},
                   {{"pou", "Twice"},
                    {"line", 3},
                    {"file", "a.st"},
                    {"locals", json::array({{{"name", "x"}, {"type", "INT"}, {"value", "3"}},
                                            {{"name", "Twice"}, {"type", "INT"}, {"value", "0"}}})}},
                   {{"pou", "Full"}, {"line", 4}, {"file", "a.st"}, {"locals_left_out", true}},
                   {{"pou", "Main"}, {"line", 20}, {"file", "a.st"}, {"instance", "Main"}}});
  DebuggedInstance instance_;
  DebugLink link_{instance_.requests(), "cell", "line1"};
  DebugConsole sut_{link_};
};

TEST_F(DebugConsoleTest, PrintSaysWhatIsForced) {
  (void)said("tasks");
  instance_.force_all();
  EXPECT_EQ(said("print n"), "Main.c.n = 2  forced\n");
  EXPECT_EQ(said("print Main.t[]"), "Main.t[] = [3, 4]  elements forced\n");
}

// While no line comes, halts are told after 100 ms.
TEST_F(DebugConsoleTest, WaitIsOverByAHaltThatWasToldSinceTheLastContinue) {
  EXPECT_THAT(said("wait 0"), HasSubstr("task fast halts"));
  EXPECT_THAT(said("wait 0"), HasSubstr("no further task has halted within"));
  (void)said("continue");
  instance_.halt("fast", 2, stack_);
  testing::internal::CaptureStdout();
  EXPECT_TRUE(sut_.look());
  EXPECT_THAT(testing::internal::GetCapturedStdout(), HasSubstr("task fast halts"));
  EXPECT_EQ(said("wait 0"), "");
  EXPECT_THAT(said("wait 0"), HasSubstr("no further task has halted within"));
  instance_.halt("fast", 3, stack_);
  (void)said("continue");
  EXPECT_THAT(said("wait 0"), HasSubstr("no further task has halted within")) << "it is the one before";
}

class DebugConsoleFrames : public DebugConsoleTest {};

TEST_F(DebugConsoleFrames, AreChosenByNumberAndByUpAndDown) {
  (void)said("tasks");
  EXPECT_EQ(said("frame"), "#0 Counter:9 (a.st)  Main.c\n");
  EXPECT_EQ(said("up"), "#1 Twice:3 (a.st)\n");
  EXPECT_EQ(said("up 2"), "#3 Main:20 (a.st)  Main\n");
  EXPECT_EQ(said("down 3"), "#0 Counter:9 (a.st)  Main.c\n");
  EXPECT_EQ(said("frame 3"), "#3 Main:20 (a.st)  Main\n");
  EXPECT_EQ(said("frame"), "#3 Main:20 (a.st)  Main\n");
  EXPECT_FALSE(sut_.failed());
}

TEST_F(DebugConsoleFrames, AreThoseOfPrintAndSet) {
  EXPECT_THAT(said("print n"), HasSubstr("Main.c.n = 2\n"));
  (void)said("frame 3");
  EXPECT_EQ(said("print n"), "Main.n = 1\n");
  EXPECT_THAT(said("print"), HasSubstr("Main.n = 1\n"));
  (void)said("set n = 5");
  (void)said("frame 0");
  (void)said("set n = 6");
  EXPECT_THAT(instance_.written, ElementsAre("Main.n=5", "Main.c.n=6"));
}

TEST_F(DebugConsoleFrames, OfAFunctionHaveLocalVariables) {
  (void)said("tasks");
  EXPECT_EQ(said("print x"), "x = 8\n") << "the global";
  (void)said("up");
  EXPECT_EQ(said("print"), "x = 3\nTwice = 0\n");
  EXPECT_EQ(said("print X"), "x = 3\n");
  EXPECT_EQ(said("print n"), "n = 7\n");
  EXPECT_EQ(said("set x = 4"), "x = 3\n") << "as it is told";
  EXPECT_THAT(instance_.commands, ElementsAre("local fast 1 x=4"));
  (void)said("set n=5");
  EXPECT_THAT(instance_.written, ElementsAre("n=5"));
}

TEST_F(DebugConsoleFrames, HaveElementsOfLocalArrays) {
  instance_.tasks[0]["stack"][1]["locals"].push_back(
      {{"name", "grid[][]"}, {"type", "ARRAY [0..1, 1..2] OF INT"}, {"elements", {"1", "2", "3"}}});
  (void)said("frame 1");
  EXPECT_EQ(said("print"), "x = 3\nTwice = 0\ngrid[][] = [1, 2, 3, ...]\n");
  EXPECT_EQ(said("print GRID"), "grid[][] = [1, 2, 3, ...]\n");
  EXPECT_EQ(said("print grid[1, 1]"), "grid[1,1] = 3\n");
  EXPECT_EQ(said("set Grid[0][2]=7"), "grid[0,2] = 2\n") << "as it is told";
  EXPECT_THAT(instance_.commands, ElementsAre("local fast 1 Grid[0][2]=7"));
  EXPECT_THAT(said("print grid[2,1]"), HasSubstr("allowed as index 1 are 0 to 1"));
  EXPECT_THAT(said("print grid[1]"), HasSubstr("allowed as index 2 are 1 to 2"));
  EXPECT_EQ(said("set grid[1,2]=7"), "grid[1,2] = (only the first 3 elements are told)\n");
  EXPECT_EQ(instance_.commands.back(), "local fast 1 grid[1,2]=7");
  EXPECT_THAT(said("print x[1]"), HasSubstr("x is no array: it is INT"));
}

TEST_F(DebugConsoleFrames, HaveLocalArraysOfWhichNoElementIsTold) {
  instance_.tasks[0]["stack"][1]["locals"].push_back(
      {{"name", "t[]"}, {"type", "ARRAY [1..2] OF INT"}, {"elements", json::array()}});
  (void)said("frame 1");
  EXPECT_EQ(said("print t"), "t[] = [...]\n");
  EXPECT_EQ(said("print t[1]"), "t[1] = (no element is told)\n");
  EXPECT_EQ(said("set t[2]=7"), "t[2] = (no element is told)\n");
  EXPECT_EQ(instance_.commands.back(), "local fast 1 t[2]=7");
}

TEST_F(DebugConsoleFrames, WhoseLocalVariablesAreNotToldMeanNoOthers) {
  (void)said("frame 2");
  EXPECT_THAT(said("print"), HasSubstr("the local variables of this call are too long to be told"));
  EXPECT_THAT(said("print x"), HasSubstr("the local variables of this call are too long to be told"));
  EXPECT_THAT(said("set x=4"), HasSubstr("the local variables of this call are too long to be told"));
  EXPECT_TRUE(instance_.commands.empty());
  EXPECT_TRUE(instance_.written.empty());
}

TEST_F(DebugConsoleFrames, HaveStructuresWithoutAValue) {
  instance_.variables.push_back(variable_record("Main.c.pt.x", "INT", "1"));
  instance_.variables.push_back(variable_record("Main.c.pt.y", "INT", "2"));
  EXPECT_THAT(said("print pt"), HasSubstr("'pt' has members; name one, as Main.c.pt.x"));
  EXPECT_THAT(said("print Main.c.pt"), HasSubstr("'Main.c.pt' has members; name one, as Main.c.pt.x"));
  EXPECT_THAT(said("print none"), HasSubstr("no variable 'none' in 'Main.c'; references and function "
                                            "blocks among local variables are not shown"));
  instance_.tasks[0]["stack"][1]["locals"].push_back({{"name", "at.y"}, {"type", "INT"}, {"value", "4"}});
  (void)said("up");
  EXPECT_THAT(said("print AT"), HasSubstr("'AT' has members; name one, as at.y"));
  EXPECT_EQ(said("print at.y"), "at.y = 4\n");
}

TEST_F(DebugConsoleFrames, OfNoTaskHaveNoVariables) {
  instance_.tasks = json::array();
  EXPECT_THAT(said("print"), HasSubstr("no task halts where there are variables"));
}

TEST_F(DebugConsoleFrames, BeginAnewWithAHaltAndWithAnotherTask) {
  (void)said("frame 3");
  instance_.halt("fast", 2, stack_);
  EXPECT_THAT(said("frame"), HasSubstr("#0 Counter:9"));

  (void)said("frame 3");
  EXPECT_THAT(said("task fast"), Not(HasSubstr("plcctl:")));
  EXPECT_THAT(said("frame"), HasSubstr("#3 Main:20")) << "the same task";
  instance_.halt("slow", 1, json::array({stack_[3], stack_[3]}));
  (void)said("tasks");
  (void)said("up");
  (void)said("task fast");
  EXPECT_THAT(said("frame"), HasSubstr("#0 Counter:9"));
  (void)said("up");
  (void)said("stack slow");
  EXPECT_THAT(said("frame"), HasSubstr("#0 Main:20"));
}

TEST_F(DebugConsoleFrames, ThatThereAreNotAreRefused) {
  (void)said("tasks");
  EXPECT_THAT(said("down"), HasSubstr("no frame -1: task 'fast' has the frames 0 to 3"));
  EXPECT_THAT(said("frame 4"), HasSubstr("no frame 4"));
  EXPECT_THAT(said("up 4294967295"), HasSubstr("no frame 4294967295"));
  for (const char* const text : {"frame -1", "frame x", "up 1x", "down 99999999999"})
    EXPECT_THAT(said(text), HasSubstr("is no number of a frame, or of frames")) << text;
  EXPECT_THAT(said("frame"), HasSubstr("#0 Counter:9")) << "the same as before";
  instance_.tasks = json::array({{{"task", "fast"}, {"state", "runs"}}});
  EXPECT_THAT(said("up"), HasSubstr("no task halts"));
}

// A state that is too long to tell has fewer frames.
TEST_F(DebugConsoleFrames, ThatAreNotToldAnyMoreMeanNoOther) {
  (void)said("frame 3");
  instance_.halt("fast", 1, json::array({stack_[0]}));
  EXPECT_THAT(said("set n = 5"), HasSubstr("frame 3 of task 'fast' is not told at present"));
  EXPECT_TRUE(instance_.written.empty());
}

TEST_F(DebugConsoleFrames, AreInTheHelp) {
  const std::string help = said("help");
  for (const char* const word : {"frame [N]", "up [N]", "down [N]"}) EXPECT_THAT(help, HasSubstr(word));
}

}  // namespace
}  // namespace plchost
