// The application of a real plc-instance is debugged: by the commands that its debugger sends.
#include <chrono>
#include <csignal>
#include <cstdint>
#include <limits>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/instances/debugged_process.hpp"

namespace plchost::testing {
namespace {

using ::testing::HasSubstr;

class DebuggingByHand : public Debugging {
 protected:
  DebuggingByHand() { start(application("steps")); }
};

TEST_F(DebuggingByHand, HaltsOnlyTheTaskThatComesToABreakpoint) {
  attach();
  const json set = command("break Counter:13");
  EXPECT_EQ(set.value("line", 0), 14);
  EXPECT_EQ(set.value("file", ""), "src/steps.st");
  ASSERT_TRUE(halts("Main")) << state().dump(2);
  EXPECT_EQ(stack("Main"), "Counter:14 Main:23");
  EXPECT_EQ(task("Main")["stack"][0].value("instance", ""), "Main.counter");
  EXPECT_EQ(task("Main").value("reason", ""), "breakpoint");
  EXPECT_TRUE(goes_on("Other"));
  command("delete *");
  command("continue Main");
  EXPECT_TRUE(goes_on("Main"));
}

TEST_F(DebuggingByHand, ReadsAndWritesValuesOfOneMomentWhileATaskHalts) {
  attach();
  command("break Main:24");
  ASSERT_TRUE(halts("Main"));
  const ValueReply reply =
      values_->ask(values_->elements({"Main.cycles", "Main.counter.n", "Main.counter.step"}));
  EXPECT_TRUE(reply.consistent);
  const ControlReply written = process_->ask(ControlVerb::write_variable, "Main.counter.n=500");
  EXPECT_EQ(written.code, ErrorCode::ok) << written.text;
  EXPECT_EQ(stack_after("next"), "Main:26");
  EXPECT_EQ(values_->read("Main.doubled"), "1000");
}

TEST_F(DebuggingByHand, StepsIntoOverAndOut) {
  attach();
  command("break Main:22");
  ASSERT_TRUE(halts("Main"));
  command("delete *");
  EXPECT_EQ(stack_after("next"), "Main:23");
  EXPECT_EQ(stack_after("step"), "Counter:12 Main:23");
  EXPECT_EQ(stack_after("next"), "Counter:14 Main:23");
  EXPECT_EQ(stack_after("out"), "Main:24");
  EXPECT_EQ(stack_after("step"), "Twice:2 Main:24");
  EXPECT_EQ(stack_after("out"), "Main:26");
  EXPECT_EQ(stack_after("next"), "Main:22");  // of the next cycle
  command("until Main steps.st:26");
  EXPECT_TRUE(eventually([&] { return stack("Main") == "Main:26"; }));
  EXPECT_EQ(stack_after("out"), "Main:22");
}

TEST_F(DebuggingByHand, KeepsConditionsAndCounts) {
  attach();
  command("break Counter:14 hits =3 if step > 0 AND NOT (n < 10) AND Main.go");
  ASSERT_TRUE(halts("Main"));
  EXPECT_EQ(state()["breakpoints"][0].value("hits", 0), 3);
  EXPECT_GE(std::stoi(values_->read("Main.counter.n")), 12);
  command("continue Main");
  EXPECT_TRUE(goes_on("Main"));
  EXPECT_THAT(refused("break Counter:14 if speed > 3"), HasSubstr("speed"));
  EXPECT_THAT(refused("break Counter:14 if n >"), HasSubstr("ends too early"));
  EXPECT_THAT(refused("break Counter:15"), HasSubstr("its last is in line 14"));
  EXPECT_THAT(refused("break Nothing:3"), HasSubstr("Main"));
  EXPECT_THAT(refused("break Main:22 hits x"), HasSubstr("%N"));
  EXPECT_THAT(refused("dance"), HasSubstr("until TASK PLACE"));
}

TEST_F(DebuggingByHand, SaysWhichVariablesAConditionMeans) {
  attach();
  EXPECT_EQ(command("break Counter:14 if n < 0").value("remark", "x"), "");
  EXPECT_THAT(command("break Counter:14 if bias > 3").value("remark", ""),
              HasSubstr("no variables of Counter, but of the application: bias"));
  EXPECT_THAT(refused("break Lamp if lit > 0"), HasSubstr("name that of one of them, as 'left.lit'"));
  EXPECT_EQ(command("break Lamp if right.lit > 0").value("remark", "x"), "");
  EXPECT_THAT(refused("break Main:24 if counter > 3"), HasSubstr("'Main.counter' has members"));
}

TEST_F(DebuggingByHand, ShowsAndWritesLocalVariables) {
  attach();
  command("break Twice if value > 3 AND factor = 2");
  ASSERT_TRUE(halts("Main")) << state().dump(2);
  const int n = std::stoi(values_->read("Main.counter.n"));
  EXPECT_GT(n, 3);
  const json frames = task("Main")["stack"];
  ASSERT_EQ(frames.size(), 2U);
  json locals = frames[0]["locals"];
  EXPECT_EQ(locals.back()["elements"].size(), 256U);
  locals.erase(3);
  EXPECT_EQ(locals, json::array({{{"name", "value"}, {"type", "DINT"}, {"value", std::to_string(n)}},
                                 {{"name", "factor"}, {"type", "INT"}, {"value", "2"}},
                                 {{"name", "word"}, {"type", "STRING"}, {"value", "'double'"}}}));
  EXPECT_FALSE(frames[1].contains("locals")) << "it has none";
  command("local Main 0 Factor = 5");
  command("local Main 0 word='five'");
  EXPECT_EQ(task("Main")["stack"][0]["locals"][1]["value"], "5");
  EXPECT_EQ(task("Main")["stack"][0]["locals"][2]["value"], "'five'");
  EXPECT_EQ(stack_after("out"), "Main:26");
  EXPECT_EQ(values_->read("Main.doubled"), std::to_string(5 * n));
  EXPECT_THAT(refused("local Main 0 factor=5"), HasSubstr("no local variable 'factor' at Main:26"));
}

TEST_F(DebuggingByHand, ShowsAndWritesElementsOfLocalArrays) {
  attach();
  EXPECT_THAT(refused("break Twice if cells > 3"), HasSubstr("name an element, as cells[1]"));
  EXPECT_THAT(refused("break Twice if cells[301] > 3"), HasSubstr("allowed as index 1 are 1 to 300"));
  command("break Twice if cells[1] > 3 AND cells[2] = 7");
  ASSERT_TRUE(halts("Main")) << state().dump(2);
  const std::string n = values_->read("Main.counter.n");
  const auto array = [&] { return task("Main")["stack"][0]["locals"][3]; };
  EXPECT_EQ(array()["name"], "cells[]");
  EXPECT_EQ(array()["type"], "ARRAY [1..300] OF INT");
  EXPECT_EQ(array()["elements"][0], n);
  EXPECT_EQ(array()["elements"][1], "7");
  command("local Main 0 Cells[3]=1000");
  EXPECT_EQ(array()["elements"][2], "1000");
  EXPECT_THAT(refused("local Main 0 cells[0]=1"), HasSubstr("1 to 300"));
  EXPECT_THAT(refused("local Main 0 cells=1"), HasSubstr("name an element"));
  EXPECT_EQ(stack_after("out"), "Main:26");
  EXPECT_EQ(values_->read("Main.doubled"), std::to_string(2 * std::stoi(n) + 1000));
}

TEST_F(DebuggingByHand, RefusesLocalVariablesThatThereAreNot) {
  attach();
  EXPECT_THAT(refused("local Main 0 factor=5"), HasSubstr("task 'Main' does not halt"));
  command("break Twice");
  ASSERT_TRUE(halts("Main"));
  EXPECT_THAT(refused("local Main 0 factor=32768"), HasSubstr("32767"));
  EXPECT_THAT(refused("local Main 0 word='longer than 7'"), HasSubstr("word"));
  EXPECT_THAT(refused("local Main 1 factor=5"), HasSubstr("no local variable 'factor' at Main:24"));
  EXPECT_THAT(refused("local Main 2 factor=5"), HasSubstr("the frames have 0 to 1"));
  EXPECT_THAT(refused("local Main x factor=5"), HasSubstr("no frame 'x'"));
  EXPECT_THAT(refused("local Main 0 factor"), HasSubstr("NAME=VALUE"));
  EXPECT_THAT(refused("local Nobody 0 factor=5"), HasSubstr("no task 'Nobody'"));
  EXPECT_EQ(task("Main")["stack"][0]["locals"][1]["value"], "2");
}

TEST_F(DebuggingByHand, LeavesLocalVariablesOfCallersOutOfAStateThatIsTooLong) {
  attach();
  command("break Deep if level = 0");
  process_->event("edge").post();
  ASSERT_TRUE(halts("Edge"));
  const json now = state();
  EXPECT_EQ(now.value("left_out", ""), "local variables of callers, and elements of local arrays");
  const json frames = task("Edge")["stack"];
  EXPECT_EQ(frames.size(), 32U);
  EXPECT_EQ(frames[0]["locals"].size(), 9U);
  EXPECT_TRUE(frames[1].value("locals_left_out", false));
  EXPECT_FALSE(frames[1].contains("locals"));
  command("local Edge 40 level=7");
}

TEST_F(DebuggingByHand, LeavesElementsOfArraysOutBeforeOtherLocalVariables) {
  attach();
  const auto halted_at = [&](const char* breakpoint) {
    command(breakpoint);
    process_->event("edge").post();
    return halts("Edge");
  };
  const auto locals_of = [&](std::size_t frame) {
    return task("Edge")["stack"][frame].value("locals", json::array());
  };
  ASSERT_TRUE(halted_at("break Wide if NOT (from_deep OR again)"));
  EXPECT_EQ(state().value("left_out", ""), "all elements of local arrays");
  json wide = locals_of(0);
  ASSERT_EQ(wide.size(), 18U);
  EXPECT_EQ(wide[2]["name"], "a[]");
  EXPECT_EQ(wide[2]["elements"].size(), 0U);
  wide = locals_of(1);
  ASSERT_EQ(wide.size(), 18U) << "also those of its caller";
  EXPECT_EQ(wide[1]["value"], "TRUE");
  command("delete *");
  command("continue Edge");
  ASSERT_TRUE(eventually([&] { return task("Edge").value("state", "") != "halted"; }));
  ASSERT_TRUE(halted_at("break Wide if from_deep"));
  EXPECT_EQ(state().value("left_out", ""), "local variables of callers, and all elements of local arrays");
  wide = locals_of(0);
  ASSERT_EQ(wide.size(), 18U);
  EXPECT_EQ(wide[0]["value"], "TRUE");
  EXPECT_EQ(locals_of(1).size(), 0U);
}

TEST_F(DebuggingByHand, WritesLocalVariablesIntoLogPoints) {
  attach();
  command("break Twice hits %5 log {value} times {factor}");
  EXPECT_TRUE(eventually([&] { return !state()["log"].empty(); }));
  EXPECT_THAT(state()["log"][0].value("text", ""), HasSubstr(" times 2"));
  EXPECT_THAT(refused("break Twice log {word}"), HasSubstr("string"));
}

TEST_F(DebuggingByHand, WritesLogPointsAndHaltsNot) {
  attach();
  command("break Counter:14 hits %5 log n is {n} of {Main.cycles}");
  EXPECT_TRUE(eventually([&] { return !state()["log"].empty(); }));
  EXPECT_THAT(state()["log"][0].value("text", ""), HasSubstr("n is "));
  EXPECT_EQ(task("Main").value("state", ""), "runs");
  EXPECT_EQ(task("Main").value("halts", 0), 0);
}

TEST_F(DebuggingByHand, CountsReleasesOfAHaltAsNoLostCycles) {
  attach();
  const auto longest = process_->task("Main")->counters.exec_max_ns;
  bool none_lost = false;  // a core that stands still beside the halt loses cycles
  for (int round = 0; round < 5 && !none_lost; ++round) {
    const auto before = lost("Main");
    command("break Main:24");
    ASSERT_TRUE(halts("Main"));
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    command("delete *");
    command("continue Main");
    ASSERT_TRUE(goes_on("Main"));
    // The state is shown a moment after the task has gone on.
    EXPECT_TRUE(eventually([&] {
      const json main = task("Main");
      return main.value("releases_halted", 0) >= 30 && main.value("halted_ms", 0) >= 390;
    })) << state().dump(2);
    none_lost = lost("Main") - before < 20;
  }
  EXPECT_TRUE(none_lost);
  EXPECT_LT(process_->task("Main")->counters.exec_max_ns, longest + 300'000'000);
}

TEST_F(DebuggingByHand, TellsTheTimeOfAHaltThatGoesOn) {
  attach();
  command("break Main:24");
  ASSERT_TRUE(halts("Main"));
  EXPECT_TRUE(eventually([&] {
    const json main = task("Main");
    return main.value("halted_ms", 0) >= 300 && main.value("releases_halted", 0) >= 30;
  })) << state().dump(2);
  EXPECT_EQ(task("Main").value("halts", 0), 1);
}

// No release is planned while the application is stopped.
TEST_F(DebuggingByHand, PassesNoReleasesInASingleCycle) {
  attach();
  command("break Main:24");
  ASSERT_TRUE(halts("Main"));
  ASSERT_EQ(process_->ask(ControlVerb::stop).code, ErrorCode::ok);
  ControlReply done;
  {
    const std::jthread asking([&] { done = process_->ask(ControlVerb::single_cycle); });
    EXPECT_TRUE(halts("Main"));
    const json before = task("Main");
    EXPECT_TRUE(
        eventually([&] { return task("Main").value("halted_ms", 0) >= before.value("halted_ms", 0) + 300; }));
    EXPECT_EQ(task("Main").value("releases_halted", 0), before.value("releases_halted", 0));
    command("continue Main");
  }
  EXPECT_EQ(done.code, ErrorCode::ok) << done.text;
}

TEST_F(DebuggingByHand, HaltsAllTasksIfItIsSaid) {
  attach();
  command("halts all");
  command("break Main:24");
  ASSERT_TRUE(halts("Main"));
  ASSERT_TRUE(halts("Other"));
  EXPECT_EQ(task("Other").value("reason", ""), "pause");
  command("delete *");
  command("continue *");
  EXPECT_TRUE(goes_on("Main"));
  EXPECT_TRUE(goes_on("Other"));
}

TEST_F(DebuggingByHand, PausesAtTheNextStatement) {
  attach();
  command("pause Other");
  ASSERT_TRUE(halts("Other"));
  EXPECT_EQ(task("Other").value("reason", ""), "pause");
  EXPECT_TRUE(goes_on("Main"));
}

TEST_F(DebuggingByHand, LetsTasksGoWhenTheDebuggerLeaves) {
  attach();
  command("break Main:24");
  ASSERT_TRUE(halts("Main"));
  EXPECT_EQ(debug("attach").code, ErrorCode::busy);
  command("detach");
  EXPECT_TRUE(goes_on("Main"));
  EXPECT_TRUE(state()["breakpoints"].empty());
  EXPECT_THAT(refused("pause Main"), HasSubstr("is over"));
  EXPECT_THAT(process_->log(), HasSubstr("1 halted task goes on"));
}

TEST_F(DebuggingByHand, LetsTasksGoWhenTheDebuggerIsSilent) {
  attach();
  command("break Main:24");
  ASSERT_TRUE(halts("Main"));
  session_ = 0;  // looks without being the debugger
  EXPECT_TRUE(eventually([&] { return state().value("session", 1) == 0; }));
  EXPECT_TRUE(goes_on("Main"));
  EXPECT_THAT(process_->log(), HasSubstr("its debugger was silent for 10 s"));
}

TEST_F(DebuggingByHand, LetsTasksGoAlsoIfAStrangerHasWrittenATimeThatIsStillToCome) {
  attach();
  command("break Main:24");
  ASSERT_TRUE(halts("Main"));
  auto memory = MemoryFile::open(debug_page_name(sandbox_.pool(), "line1"), sizeof(DebugPageLayout),
                                 MemoryFile::Access::read_write);
  ASSERT_TRUE(memory);
  auto& page = *reinterpret_cast<DebugPageLayout*>(memory->bytes().data());
  page.asking_session.store(session_);
  page.asked_ns.store(std::numeric_limits<std::int64_t>::max());
  session_ = 0;
  EXPECT_TRUE(eventually([&] { return state().value("session", 1) == 0; }));
  EXPECT_TRUE(goes_on("Main"));
}

// A debugger that has not looked for a while takes no session of another one.
TEST_F(DebuggingByHand, HasSessionsOfWhichNoneIsThatOfAnotherProcess) {
  attach();
  const std::uint64_t before = session_;
  process_.reset();
  start(application("steps"));
  attach();
  EXPECT_NE(session_, before);
  session_ = before;
  EXPECT_THAT(refused("continue *"), HasSubstr("is over"));
}

TEST_F(DebuggingByHand, ShowsANewDebuggerNoLinesOfTheOneBefore) {
  attach();
  command("break Counter:14 log n is {n}");
  EXPECT_TRUE(eventually([&] { return !state()["log"].empty(); }));
  command("detach");
  attach();
  EXPECT_TRUE(state()["log"].empty());
}

TEST_F(DebuggingByHand, StopsAndStartsAHaltedTask) {
  attach();
  command("break Main:24");
  ASSERT_TRUE(halts("Main"));
  const ControlReply stopped = process_->ask(ControlVerb::stop);
  EXPECT_EQ(stopped.code, ErrorCode::ok) << stopped.text;
  EXPECT_THAT(stopped.text, HasSubstr("1 halted task was let go first"));
  for (const char* const name : {"Main", "Other", "Edge"})
    EXPECT_EQ(task(name).value("state", ""), "stopped") << "with the reply";
  EXPECT_EQ(process_->ask(ControlVerb::start).code, ErrorCode::ok);
  EXPECT_NE(task("Other").value("state", ""), "stopped") << "with the reply";
  EXPECT_TRUE(halts("Main"));
  EXPECT_EQ(process_->end(SIGTERM), 0);
}

/// Under the scheduler of that name.
class DebuggingUnder : public DebuggingByHand, public ::testing::WithParamInterface<std::string> {};
INSTANTIATE_TEST_SUITE_P(Each, DebuggingUnder, ::testing::Values("CmpScheduleTimer", "CmpScheduleOneShot"),
                         [](const auto& scheduler) { return scheduler.param; });

TEST_P(DebuggingUnder, IgnoresTasksOfExternalEvents) {
  attach();
  EXPECT_EQ(command("break Edge").value("remark", "x"), "");
  PoolEvent edge = process_->event("edge");
  edge.post();
  ASSERT_TRUE(halts("Edge"));
  const ControlReply switched = process_->ask(ControlVerb::set_scheduler, GetParam());
  EXPECT_EQ(process_->runtime().scheduler.view(), GetParam());
  EXPECT_THAT(switched.text, HasSubstr("1 halted task was let go first"));
  EXPECT_EQ(task("Edge").value("state", ""), "ignored");
  EXPECT_THAT(command("break Edge:42").value("remark", ""), HasSubstr("Edge"));
  ASSERT_TRUE(eventually([&] { return cycles("Edge") == 1; })) << "the one that was let go";
  edge.post();
  EXPECT_TRUE(eventually([&] { return cycles("Edge") == 2; }));
  command("break Main:24");
  EXPECT_TRUE(halts("Main")) << "those of cyclic tasks are not ignored";
}

TEST_F(DebuggingByHand, TakesAnotherVersionWhileATaskHalts) {
  attach();
  command("break Counter:14");
  ASSERT_TRUE(halts("Main"));
  const ControlReply changed = process_->ask(ControlVerb::change_application, application("steps"));
  EXPECT_EQ(changed.code, ErrorCode::ok) << changed.text;
  EXPECT_THAT(changed.text, HasSubstr("1 halted task was let go first"));
  EXPECT_TRUE(halts("Main"));  // at the breakpoint in the new version
  EXPECT_EQ(stack("Main"), "Counter:14 Main:23");
}

TEST_F(DebuggingByHand, TellsOfWatchdogsNothing) {
  attach();
  command("break Main:24");
  ASSERT_TRUE(halts("Main"));
  std::this_thread::sleep_for(std::chrono::seconds(4));  // longer than the guard against endless loops
  EXPECT_EQ(task("Main").value("state", ""), "halted");
  command("delete *");
  command("continue *");
  EXPECT_TRUE(goes_on("Main"));
  EXPECT_TRUE(process_->runtime().running);
}

TEST(DebugBuild, IsRefusedWhereItIsNotAllowed) {
  const Sandbox sandbox;
  InstanceProcess process(sandbox, {"--application", application("steps"), "--no-debug"});
  EXPECT_EQ(process.end(), 3);
  EXPECT_THAT(process.log(), HasSubstr("allow_debug = false"));
}

TEST(DebugBuild, IsNoneWithoutTheMacros) {
  const Sandbox sandbox;
  InstanceProcess process(sandbox, {"--application", application("seen"), "--no-debug"});
  process.wait_until_up(true);
  const ControlReply reply = process.ask(ControlVerb::debug, "attach");
  EXPECT_EQ(reply.code, ErrorCode::unsupported);
  EXPECT_THAT(reply.text, HasSubstr("--debug"));
}

}  // namespace
}  // namespace plchost::testing
