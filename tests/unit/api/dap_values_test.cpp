// The values that a client of the Debug Adapter Protocol is shown.
#include <algorithm>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/api/dap_client.hpp"

namespace plchost {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

class DapForces : public DapSessionTest {
 protected:
  DapForces() { instance_.force_all(); }
};

TEST_F(DapForces, AreShownBesideTheValue) {
  EXPECT_THAT(shown(kInnermost),
              ElementsAre("n=2 (forced)", "text='on' (forced)", "t[]=[3, 4] (elements forced)"));
  for (const char* const context : {"hover", "watch", "repl"})
    EXPECT_EQ(result("n", context), "2 (forced)") << context;
}

TEST_F(DapForces, AreNoPartOfACopiedValue) {
  EXPECT_TRUE(ask("initialize")["supportsClipboardContext"]);
  EXPECT_EQ(result("n", "clipboard"), "2");
}

// An editor offers the text that it shows.
TEST_F(DapForces, AreNoPartOfAValueThatIsSet) {
  const auto set = [&](const char* value) {
    return ask("setVariable", {{"variablesReference", kInnermost}, {"name", "n"}, {"value", value}});
  };
  EXPECT_EQ(set("3 (forced)")["value"], "2 (forced)") << "as it is now";
  (void)set("4");
  EXPECT_THAT(instance_.written, ElementsAre("Main.c.n=3", "Main.c.n=4"));
}

TEST_F(DapSessionTest, GivesPlainValuesOfVariablesThatAreNotForced) {
  EXPECT_THAT(shown(kInnermost), ElementsAre("n=2", "text='on'", "t[]=[3, 4]"));
  EXPECT_EQ(result("n", "hover"), "2");
}

TEST_F(DapSessionTest, FindsAnArrayByTheNameThatItShows) {
  const json body = ask("variables", {{"variablesReference", kInnermost}});
  EXPECT_EQ(result(body["variables"][2]["evaluateName"], "watch"), "[3, 4]");
  EXPECT_EQ(result("t[]", "watch"), "[3, 4]");
}

TEST_F(DapSessionTest, ExpandsAnArrayAndSetsItsElements) {
  instance_.elements = {variable_record("Main.c.t[1]", "INT", "3"),
                        variable_record("Main.c.t[2]", "INT", "4")};
  const json array = ask("variables", {{"variablesReference", kInnermost}})["variables"][2];
  EXPECT_EQ(array["indexedVariables"], 2);
  const int reference = array["variablesReference"];
  EXPECT_THAT(shown(reference), ElementsAre("[1]=3", "[2]=4"));
  const json last =
      ask("variables", {{"variablesReference", reference}, {"start", 1}, {"count", 9}})["variables"];
  ASSERT_EQ(last.size(), 1U);
  EXPECT_EQ(last[0]["name"], "[2]");
  EXPECT_EQ(last[0]["evaluateName"], "Main.c.t[2]");
  (void)ask("setVariable", {{"variablesReference", reference}, {"name", "[2]"}, {"value", "9"}});
  EXPECT_THAT(instance_.written, ElementsAre("Main.c.t[2]=9"));
  EXPECT_EQ(ask("evaluate", {{"expression", "t"}, {"frameId", kInnermost}})["variablesReference"], reference);
  EXPECT_FALSE(answer("variables", {{"variablesReference", reference + 1}})["success"]);
}

TEST_F(DapSessionTest, TellsThePartOfALargeArrayThatItsClientAsksFor) {
  constexpr int kElements = 100'000;
  instance_.variables.push_back(variable_record("Main.c.big[]", "ARRAY [1..100000] OF INT", "[0...]"));
  instance_.make_element = [](const std::string& name) { return variable_record(name, "INT", "0"); };
  const json array = ask("variables", {{"variablesReference", kInnermost}})["variables"].back();
  ASSERT_EQ(array["indexedVariables"], kElements);
  EXPECT_EQ(array["namedVariables"], 0);
  const auto part = [&](const json& more) {
    json arguments = {{"variablesReference", array["variablesReference"]}};
    arguments.update(more);
    instance_.asked_patterns = 0;
    return ask("variables", arguments)["variables"];
  };
  const json page = part({{"filter", "indexed"}, {"start", 99'900}, {"count", 50}});
  ASSERT_EQ(page.size(), 50U);
  EXPECT_EQ(page.front()["name"], "[99901]");
  EXPECT_EQ(page.back()["evaluateName"], "Main.c.big[99950]");
  EXPECT_EQ(instance_.asked_patterns, 50U) << "no others are read";
  EXPECT_EQ(part({{"start", 99'990}, {"count", 500}}).size(), 10U);
  EXPECT_EQ(part({{"start", 100'000}, {"count", 5}}).size(), 0U);
  EXPECT_EQ(part({{"filter", "named"}}).size(), 0U);
  EXPECT_EQ(part({{"start", 99'000}, {"count", 0}}).size(), 1'000U) << "all behind it";
  EXPECT_EQ(part({{"start", 0}, {"count", 3'000}}).size(), 3'000U);
  const json begin = part({{"start", 98'000}});
  ASSERT_EQ(begin.size(), 1'025U);
  EXPECT_EQ(begin.back()["value"], "976 elements not told");
}

/// An array of 100,000 elements; each request for variables takes a while.
class DapSlowInstance : public DapSessionTest {
 protected:
  DapSlowInstance() {
    instance_.variables.push_back(variable_record("Main.c.big[]", "ARRAY [1..100000] OF INT", "[0...]"));
    instance_.make_element = [](const std::string& name) { return variable_record(name, "INT", "0"); };
    reference_ =
        ask("variables", {{"variablesReference", kInnermost}})["variables"].back()["variablesReference"];
    instance_.slowness = std::chrono::milliseconds(200);
    (void)sut_.look();
    instance_.signs.clear();
    begin_ = instance_.now;
  }
  // Between signs, and between the last one and now.
  [[nodiscard]] Duration longest_silence() const {
    TimePoint last = begin_;
    Duration longest{};
    for (const TimePoint sign : instance_.signs)
      longest = std::max(longest, sign - std::exchange(last, sign));
    return std::max(longest, instance_.now - last);
  }

  int reference_ = 0;
  TimePoint begin_;
};

// The instance ends a session without a sign for 10 s.
TEST_F(DapSlowInstance, HearsOfItsDebuggerWhileALongArrayIsRead) {
  const json told =
      ask("variables", {{"variablesReference", reference_}, {"start", 0}, {"count", 100'000}})["variables"];
  EXPECT_GT(told.size(), 1'024U);
  EXPECT_EQ(told.back()["name"], "...");
  EXPECT_EQ(told.back()["value"], fmt::format("{} elements not told", 100'001 - told.size()));
  EXPECT_EQ(instance_.now - begin_, std::chrono::seconds(5));
  EXPECT_EQ(longest_silence(), std::chrono::seconds(1));
}

TEST_F(DapSlowInstance, HearsOfItsDebuggerWhileManyRequestsAreCarriedOut) {
  for (int i = 0; i < 30; ++i)
    (void)ask("variables", {{"variablesReference", reference_}, {"start", 100 * i}, {"count", 100}});
  EXPECT_EQ(longest_silence(), std::chrono::seconds(1));
}

TEST_F(DapSessionTest, TellsThePartOfAScopeThatItsClientAsksFor) {
  const auto names = [&](const json& more) {
    json arguments = {{"variablesReference", kInnermost}};
    arguments.update(more);
    std::vector<std::string> all;
    const json body = ask("variables", arguments);
    for (const json& one : body["variables"]) all.push_back(one["name"]);
    return all;
  };
  EXPECT_THAT(names({{"filter", "named"}}), ElementsAre("n", "text", "t[]"));
  EXPECT_THAT(names({{"filter", "indexed"}}), IsEmpty());
  EXPECT_THAT(names({{"start", 1}, {"count", 1}}), ElementsAre("text"));
  EXPECT_THAT(names({{"start", 2}}), ElementsAre("t[]"));
  EXPECT_THAT(names({{"start", 9}, {"count", 9}}), IsEmpty());
}

TEST_F(DapSessionTest, AFrameHasTheGlobalsOfTheApplication) {
  instance_.variables.push_back(variable_record("limit", "INT", "7"));
  instance_.variables.push_back(variable_record("line.total", "DINT", "8"));
  const json scope = ask("scopes", {{"frameId", kCaller}})["scopes"].back();
  EXPECT_EQ(scope["name"], "Globals");
  EXPECT_EQ(scope["expensive"], true);
  const int reference = scope["variablesReference"];
  EXPECT_THAT(shown(reference), ElementsAre("limit=7")) << "without programs: those without a dot";
  instance_.variables.push_back(variable_record("MAIN", "STRING[5]", "'Press'"));
  dds::copy_text(instance_.variables.back().area, "program");
  EXPECT_THAT(shown(reference), ElementsAre("limit=7", "line.total=8"));
  (void)ask("setVariable", {{"variablesReference", reference}, {"name", "line.total"}, {"value", "9"}});
  EXPECT_THAT(instance_.written, ElementsAre("line.total=9"));
}

TEST_F(DapSessionTest, EachFrameHasTheValuesOfItsOwnInstance) {
  const json frames = ask("stackTrace", {{"threadId", 1}})["stackFrames"];
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames[2]["id"], kCaller);
  EXPECT_EQ(ask("scopes", {{"frameId", kInnermost}})["scopes"][0]["name"], "Main.c");
  const json scope = ask("scopes", {{"frameId", kCaller}})["scopes"][0];
  EXPECT_EQ(scope["name"], "Main");
  EXPECT_THAT(shown(scope["variablesReference"]), Contains("n=1"));
  EXPECT_EQ(ask("evaluate", {{"expression", "n"}, {"frameId", kCaller}})["result"], "1");
  (void)ask("setVariable", {{"variablesReference", kCaller}, {"name", "n"}, {"value", "5"}});
  EXPECT_THAT(instance_.written, ElementsAre("Main.n=5"));
}

TEST_F(DapSessionTest, TellsWhyAnOwnVariableIsNotRead) {
  instance_.no_variable = ErrorCode::invalid_argument;  // as of an index out of its range
  const json response = answer("evaluate", {{"expression", "t[9]"}, {"frameId", kInnermost}});
  EXPECT_FALSE(response["success"]);
  EXPECT_EQ(response.value("message", ""), "no variable 'Main.c.t[9]'") << "and not that of a global";
}

TEST_F(DapSessionTest, AFrameOfAFunctionHasItsLocalVariables) {
  constexpr int kFunction = kInnermost + 1;
  const json scopes = ask("scopes", {{"frameId", kFunction}})["scopes"];
  ASSERT_EQ(scopes.size(), 2U) << "those and the globals";
  EXPECT_EQ(scopes[0]["name"], "Locals");
  const int reference = scopes[0]["variablesReference"];
  EXPECT_THAT(shown(reference), ElementsAre("n=3"));
  EXPECT_EQ(ask("evaluate", {{"expression", "N"}, {"frameId", kFunction}})["result"], "3");
  EXPECT_EQ(ask("evaluate", {{"expression", "Main.n"}, {"frameId", kFunction}})["result"], "1");
  EXPECT_EQ(ask("setVariable", {{"variablesReference", reference}, {"name", "n"}, {"value", "4"}})["value"],
            "3");
  (void)ask("evaluate", {{"expression", "n := 5"}, {"frameId", kFunction}, {"context", "repl"}});
  EXPECT_THAT(instance_.commands, ElementsAre("local fast 1 n=4", "local fast 1 n=5"));
  EXPECT_THAT(instance_.written, IsEmpty());
  EXPECT_FALSE(
      answer("setVariable", {{"variablesReference", 9999}, {"name", "n"}, {"value", "4"}})["success"]);
}

TEST_F(DapSessionTest, ExpandsALocalArrayAndSetsItsElements) {
  constexpr int kFunction = kInnermost + 1;
  json elements = json::array();
  for (int i = 0; i < 3; ++i) elements.push_back(std::to_string(i));
  instance_.tasks[0]["stack"][1]["locals"].push_back(
      {{"name", "t[]"}, {"type", "ARRAY [1..5] OF INT"}, {"elements", elements}});
  (void)ask("stackTrace", {{"threadId", 1}});
  const json scope = ask("scopes", {{"frameId", kFunction}})["scopes"][0];
  EXPECT_EQ(scope["namedVariables"], 2);
  const json locals = ask("variables", {{"variablesReference", scope["variablesReference"]}})["variables"];
  ASSERT_EQ(locals.size(), 2U);
  EXPECT_EQ(locals[1]["value"], "[0, 1, 2, ...]");
  EXPECT_EQ(locals[1]["indexedVariables"], 5);
  const int reference = locals[1]["variablesReference"];
  EXPECT_THAT(shown(reference), ElementsAre("[1]=0", "[2]=1", "[3]=2", "...=2 elements not told"));
  const json set = ask("setVariable", {{"variablesReference", reference}, {"name", "[2]"}, {"value", "9"}});
  EXPECT_EQ(set["value"], "1") << "as it is told";
  (void)ask("evaluate", {{"expression", "T[3] := 8"}, {"frameId", kFunction}, {"context", "repl"}});
  EXPECT_THAT(instance_.commands, ElementsAre("local fast 1 t[2]=9", "local fast 1 T[3]=8"));
  EXPECT_THAT(instance_.written, IsEmpty());
  EXPECT_EQ(ask("evaluate", {{"expression", "t"}, {"frameId", kFunction}})["variablesReference"], reference);
  EXPECT_EQ(ask("evaluate", {{"expression", "t[1]"}, {"frameId", kFunction}})["result"], "0");
  EXPECT_FALSE(answer("evaluate", {{"expression", "t[6]"}, {"frameId", kFunction}})["success"]);
  instance_.tasks[0]["stack"][1].erase("locals");
  (void)ask("stackTrace", {{"threadId", 1}});
  EXPECT_FALSE(answer("variables", {{"variablesReference", reference}})["success"]) << "of another call";
}

TEST_F(DapSessionTest, LocalVariablesThatAreNotToldMeanNoOthers) {
  instance_.tasks[0]["stack"][0]["locals_left_out"] = true;
  (void)ask("stackTrace", {{"threadId", 1}});
  const json scopes = ask("scopes", {{"frameId", kInnermost}})["scopes"];
  ASSERT_EQ(scopes.size(), 3U);
  const auto fails = [&](const std::string& command, const json& arguments) {
    return !answer(command, arguments)["success"].get<bool>();
  };
  EXPECT_TRUE(fails("variables", {{"variablesReference", scopes[0]["variablesReference"]}}));
  EXPECT_TRUE(fails("evaluate", {{"expression", "n"}, {"frameId", kInnermost}}));
  EXPECT_THAT(shown(scopes[1]["variablesReference"]), Contains("n=2"));
}

}  // namespace
}  // namespace plchost
