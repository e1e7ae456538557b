// The life of an application in a real plc-instance: each verb in each state, and stops that do not come to
// an end.
#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/launch/launch_contract.hpp"
#include "shm/pages/exception_history.hpp"
#include "tests/integration/instances/instance_process.hpp"
#include "tests/support/receive_until.hpp"

namespace plchost::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class LifeInProcess : public ::testing::Test {
 protected:
  /// Of the phases of a stop.
  struct Limits {
    int outputs_ms;
    int others_ms;
  };
  /// `limit_ms`: of both phases.
  void start(int limit_ms, std::vector<std::string> more = {}) {
    start(Limits{.outputs_ms = limit_ms, .others_ms = limit_ms}, "", std::move(more));
  }
  /// `sections`: more of the settings.
  void start(Limits limits, const std::string& sections, std::vector<std::string> more = {}) {
    const std::string settings = sandbox_.write(
        "line1.cfg", fmt::format("[CmpSchedule]\nWatchdog.DefaultTimeMs=0\nStop.OutputsLimitMs={}\n"
                                 "Stop.OthersLimitMs={}\n[Task.Output]\nDrivesOutputs=1\n{}",
                                 limits.outputs_ms, limits.others_ms, sections));
    more.insert(more.end(), {"--settings", settings, "--application", application("held")});
    const bool stopped = std::ranges::find(more, "--stopped") != more.end();
    sut_.emplace(sandbox_, more);
    sut_->wait_until_up(!stopped);
  }
  [[nodiscard]] std::uint64_t cycles(const std::string& task) const {
    const auto found = sut_->task(task);
    return found ? found->counters.cycles : 0;
  }
  void hold(const std::string& task) {
    EXPECT_EQ(sut_->event(task == "Output" ? "hold_output" : "hold_other").post(), PostResult::posted);
    EXPECT_TRUE(eventually([&] { return sut_->log().find(task + " is held") != std::string::npos; }));
  }
  [[nodiscard]] std::vector<ExceptionEntry> exceptions() const {
    const auto history = read_exceptions(exception_path(sandbox_.folder(), "line1"));
    EXPECT_TRUE(history) << history.error().describe();
    return history.value_or(ExceptionHistory{}).entries;
  }
  static void expect_stop_timeout(const ExceptionEntry& entry, const std::string& task, int limit_ms,
                                  const std::string& phase) {
    EXPECT_EQ(entry.kind, "stop_timeout");
    EXPECT_EQ(entry.task, task);
    EXPECT_THAT(entry.text, AllOf(HasSubstr(fmt::format("after {} ms", limit_ms)), HasSubstr(phase)));
    EXPECT_THAT(entry.application, HasSubstr("held.so"));
    EXPECT_TRUE(entry.whole_application);
    EXPECT_EQ(entry.signal, "");
    EXPECT_GT(entry.unix_ns, 0);
  }
  [[nodiscard]] ApplicationState state() const {
    const auto page = InstancePageReader::open(sandbox_.pool(), "line1");
    const auto runtime = page ? page->runtime() : std::nullopt;
    return runtime ? runtime->state : ApplicationState::none;
  }
  bool wait_for(ApplicationState wanted) {
    return eventually([&] { return state() == wanted; });
  }
  static void send(PacketSocket& socket, ControlVerb verb, std::uint64_t number) {
    EXPECT_TRUE(socket.send(encode(ControlRequest{number, verb, "line1", ""})));
  }
  static ControlReply receive(PacketSocket& socket) {
    const auto packet = receive_until(socket, MonotonicClock::now() + 30s);
    EXPECT_TRUE(packet);
    return packet ? decode_reply(*packet).value_or(ControlReply{}) : ControlReply{};
  }
  void expect_refused(ControlVerb verb, ErrorCode code, const std::string& text,
                      const std::string& argument = {}) {
    const auto reply = sut_->ask(verb, argument);
    EXPECT_EQ(reply.code, code) << to_string(verb) << ": " << reply.text;
    EXPECT_THAT(reply.text, HasSubstr(text)) << to_string(verb);
  }
  void expect_exception_of(const std::string& task) {
    EXPECT_EQ(state(), ApplicationState::exception);
    EXPECT_EQ(sut_->task(task)->state, PageTaskState::exception);
    EXPECT_TRUE(eventually([&] { return sut_->task("Free")->state == PageTaskState::stopped; }));
    expect_refused(ControlVerb::start, ErrorCode::wrong_state, "reset it first");
    expect_refused(ControlVerb::single_cycle, ErrorCode::wrong_state, "reset it first");
    expect_refused(ControlVerb::set_scheduler, ErrorCode::wrong_state, "reset it first", "CmpScheduleTimer");
    expect_refused(ControlVerb::stop, ErrorCode::ok, "reset it to go on");
    EXPECT_EQ(sut_->ask(ControlVerb::status).code, ErrorCode::ok);
    EXPECT_EQ(sut_->end(SIGTERM), EXIT_FAILURE);  // a thread is caught in the application
    EXPECT_THAT(sut_->log(), HasSubstr(task));
  }

  Sandbox sandbox_;
  std::optional<InstanceProcess> sut_;
};

TEST_F(LifeInProcess, ServesOthersWhileItStops) {
  start(10'000);
  hold("Output");
  PacketSocket socket = sut_->connect();
  send(socket, ControlVerb::stop, 9);
  ASSERT_TRUE(wait_for(ApplicationState::stopping));
  EXPECT_EQ(sut_->ask(ControlVerb::status).code, ErrorCode::ok);
  for (const ControlVerb verb : {ControlVerb::start, ControlVerb::stop, ControlVerb::single_cycle}) {
    expect_refused(verb, ErrorCode::busy, "is stopping");
  }
  expect_refused(ControlVerb::set_scheduler, ErrorCode::busy, "is stopping", "CmpScheduleTimer");
  const auto before = cycles("Free");
  EXPECT_TRUE(eventually([&] { return cycles("Free") > before + 10; }));  // the others run on
  const auto beat = sut_->runtime().heartbeat_ns;
  EXPECT_TRUE(eventually([&] { return sut_->runtime().heartbeat_ns > beat; }));
  EXPECT_EQ(sut_->event("let_go").post(), PostResult::posted);
  const auto reply = receive(socket);
  EXPECT_EQ(reply.code, ErrorCode::ok) << reply.text;
  EXPECT_EQ(reply.number, 9U);
  EXPECT_EQ(state(), ApplicationState::stopped);
  EXPECT_EQ(sut_->ask(ControlVerb::start).code, ErrorCode::ok);
  EXPECT_EQ(sut_->end(SIGTERM), EXIT_SUCCESS);
}

TEST_F(LifeInProcess, GoesToExceptionByATaskThatDrivesOutputsAndDoesNotStop) {
  start({.outputs_ms = 200, .others_ms = 10'000}, "");
  hold("Output");
  expect_refused(ControlVerb::stop, ErrorCode::timed_out, "task Output (after 200 ms)");
  ASSERT_EQ(exceptions().size(), 1U);
  expect_stop_timeout(exceptions()[0], "Output", 200, "first phase of a stop (tasks that drive outputs)");
  expect_exception_of("Output");
}

TEST_F(LifeInProcess, GoesToExceptionByAnotherTaskThatDoesNotStop) {
  start({.outputs_ms = 10'000, .others_ms = 200}, "");
  hold("Other");
  expect_refused(ControlVerb::stop, ErrorCode::timed_out, "task Other (after 200 ms)");
  ASSERT_EQ(exceptions().size(), 1U);
  expect_stop_timeout(exceptions()[0], "Other", 200, "second phase of a stop");
  expect_exception_of("Other");
}

TEST_F(LifeInProcess, GoesToExceptionByAnEventVariableThatDoesNotReturnInAStop) {
  start({.outputs_ms = 200, .others_ms = 300}, "");
  EXPECT_EQ(sut_->event("hold_variable").post(), PostResult::posted);
  EXPECT_TRUE(eventually([&] { return cycles("HoldVariable") == 1; }));
  std::this_thread::sleep_for(500ms);  // it is read a thousand times a second
  expect_refused(ControlVerb::stop, ErrorCode::timed_out, "task Edge (its event variable, after 300 ms)");
  ASSERT_EQ(exceptions().size(), 1U);
  EXPECT_EQ(exceptions()[0].kind, "stop_timeout");
  EXPECT_EQ(exceptions()[0].task, "Edge");
  EXPECT_THAT(exceptions()[0].text, HasSubstr("its event variable has not returned after 300 ms"));
  expect_exception_of("Edge");
}

TEST_F(LifeInProcess, GoesToExceptionByAnEventVariableThatDoesNotReturnAtTheStart) {
  ::setenv("PLC_HOLD_VARIABLE", "1", 1);
  start({.outputs_ms = 200, .others_ms = 300}, "", {"--stopped"});
  ::unsetenv("PLC_HOLD_VARIABLE");
  EXPECT_EQ(sut_->ask(ControlVerb::start).code, ErrorCode::ok);
  EXPECT_TRUE(wait_for(ApplicationState::exception));
  ASSERT_EQ(exceptions().size(), 1U);
  EXPECT_EQ(exceptions()[0].task, "Edge");
  EXPECT_THAT(exceptions()[0].text, HasSubstr("still running in its event variable after 3000"));
  expect_exception_of("Edge");
}

TEST_F(LifeInProcess, KeepsAnExceptionForEachTaskThatDoesNotStop) {
  start({.outputs_ms = 100, .others_ms = 200}, "");
  hold("Output");
  hold("Other");
  expect_refused(ControlVerb::stop, ErrorCode::timed_out, "task Output (after 100 ms), Other (after 200 ms)");
  ASSERT_EQ(exceptions().size(), 2U);
  expect_stop_timeout(exceptions()[0], "Output", 100, "first phase");
  expect_stop_timeout(exceptions()[1], "Other", 200, "second phase");
  expect_exception_of("Output");
}

TEST_F(LifeInProcess, KeepsTheStopTimeoutOfATaskThatAWatchdogCatchesLater) {
  start({.outputs_ms = 200, .others_ms = 200}, "[Task.Other]\nWatchdog.TimeUs=8000000\n");
  hold("Other");
  expect_refused(ControlVerb::stop, ErrorCode::timed_out, "task Other");
  std::this_thread::sleep_for(9s);
  ASSERT_EQ(exceptions().size(), 1U);
  expect_stop_timeout(exceptions()[0], "Other", 200, "second phase");
  EXPECT_EQ(sut_->end(SIGTERM), EXIT_SUCCESS) << "it is not caught";
  EXPECT_THAT(sut_->log(), Not(HasSubstr("application: exit")));
}

TEST_F(LifeInProcess, KeepsNoExceptionOfAStopThatComesToItsEnd) {
  start(10'000);
  EXPECT_EQ(sut_->ask(ControlVerb::stop).code, ErrorCode::ok);
  EXPECT_EQ(sut_->end(SIGTERM), EXIT_SUCCESS);
  EXPECT_THAT(exceptions(), ::testing::IsEmpty());
}

TEST_F(LifeInProcess, KeepsEventsBoundAsLongAsTheirTasksRunWhatIsPosted) {
  start({.outputs_ms = 10'000, .others_ms = 10'000}, "[Task.HoldOutput]\nDrivesOutputs=1\n");
  const auto bound = [&](const char* event) { return sut_->event(event).bound_tasks(); };
  hold("Output");
  EXPECT_EQ(bound("hold_output"), 1U);
  PacketSocket socket = sut_->connect();
  send(socket, ControlVerb::stop, 9);
  ASSERT_TRUE(wait_for(ApplicationState::stopping));
  EXPECT_EQ(bound("hold_output"), 0U) << "its task drives outputs: it runs nothing any more";
  EXPECT_EQ(sut_->event("hold_output").post(), PostResult::no_task);
  EXPECT_EQ(bound("hold_other"), 1U);
  hold("Other");  // posted, and run
  EXPECT_EQ(sut_->event("let_output_go").post(), PostResult::posted);
  EXPECT_TRUE(eventually([&] { return bound("let_go") == 0; })) << "in the second phase nothing is run";
  EXPECT_EQ(state(), ApplicationState::stopping);
  const auto let_go = cycles("LetGo");
  EXPECT_EQ(sut_->event("let_go").post(), PostResult::no_task);
  EXPECT_EQ(cycles("HoldOutput"), 1U);
  EXPECT_EQ(cycles("LetGo"), let_go);
}

TEST_F(LifeInProcess, BindsItsEventsAgainWithTheNextStart) {
  start(10'000);
  for (int round = 0; round < 3; ++round) {
    EXPECT_EQ(sut_->event("let_go").bound_tasks(), 1U);
    EXPECT_EQ(sut_->ask(ControlVerb::stop).code, ErrorCode::ok);
    EXPECT_EQ(sut_->event("let_go").bound_tasks(), 0U);
    EXPECT_EQ(sut_->event("let_go").post(), PostResult::no_task);
    EXPECT_EQ(sut_->ask(ControlVerb::start).code, ErrorCode::ok);
  }
}

TEST_F(LifeInProcess, StopsInTwoPhasesAtTheEndOfTheProcess) {
  start(10'000);
  hold("Output");
  ::kill(sut_->pid(), SIGTERM);
  ASSERT_TRUE(wait_for(ApplicationState::stopping));
  const auto before = cycles("Free");
  EXPECT_TRUE(eventually([&] { return cycles("Free") > before + 10; }));
  (void)sut_->event("let_go").post();
  EXPECT_EQ(sut_->end(), EXIT_SUCCESS);
  EXPECT_THAT(sut_->log(), HasSubstr("application: exit"));
}

TEST_F(LifeInProcess, EndsAtOnceWhenItIsAskedTwice) {
  start(10'000);
  hold("Other");
  EXPECT_EQ(sut_->ask(ControlVerb::shutdown).code, ErrorCode::ok);
  ASSERT_TRUE(wait_for(ApplicationState::stopping));
  EXPECT_EQ(sut_->end(SIGTERM), EXIT_FAILURE);
  EXPECT_THAT(sut_->log(), HasSubstr("Other"));
}

TEST_F(LifeInProcess, AnswersAStopThatAnEndOfTheProcessOvertakes) {
  start(10'000);
  hold("Other");
  PacketSocket socket = sut_->connect();
  send(socket, ControlVerb::stop, 3);
  ASSERT_TRUE(wait_for(ApplicationState::stopping));
  EXPECT_EQ(sut_->ask(ControlVerb::shutdown).code, ErrorCode::ok);
  EXPECT_EQ(sut_->end(SIGTERM), EXIT_FAILURE);
  const auto packet = receive_until(socket, MonotonicClock::now() + 30s);
  ASSERT_FALSE(packet);
  EXPECT_EQ(packet.error().code, ErrorCode::unavailable);
}

TEST_F(LifeInProcess, DoesNotWaitForAClientThatHasGone) {
  start(10'000);
  hold("Output");
  {
    PacketSocket socket = sut_->connect();
    send(socket, ControlVerb::stop, 3);
    ASSERT_TRUE(wait_for(ApplicationState::stopping));
  }
  (void)sut_->event("let_go").post();
  EXPECT_TRUE(wait_for(ApplicationState::stopped));
  EXPECT_EQ(sut_->ask(ControlVerb::start).code, ErrorCode::ok);
}

class SingleCycleUnderEachScheduler : public LifeInProcess,
                                      public ::testing::WithParamInterface<const char*> {};

TEST_P(SingleCycleUnderEachScheduler, RunsEachCyclicAndFreewheelingTaskOnce) {
  sut_.emplace(sandbox_, std::vector<std::string>{"--stopped", "--scheduler", GetParam(), "--application",
                                                  application("all_kinds")});
  sut_->wait_until_up(false);
  for (std::uint64_t round = 1; round <= 3; ++round) {
    EXPECT_EQ(sut_->ask(ControlVerb::single_cycle).code, ErrorCode::ok);
    EXPECT_EQ(state(), ApplicationState::stopped);
    EXPECT_EQ(cycles("Fast"), round);
    EXPECT_EQ(cycles("Loop"), round);
  }
  EXPECT_EQ(sut_->task("Fast")->counters.lost_cycles, 0U);
  EXPECT_EQ(cycles("Work") + cycles("Edge"), 0U);
  EXPECT_EQ(sut_->task("Fast")->state, PageTaskState::stopped);
  EXPECT_EQ(sut_->ask(ControlVerb::start).code, ErrorCode::ok);
  expect_refused(ControlVerb::single_cycle, ErrorCode::wrong_state, "stop it first");
  EXPECT_TRUE(eventually([&] { return cycles("Fast") > 20; }));
  EXPECT_EQ(sut_->ask(ControlVerb::stop).code, ErrorCode::ok);
  const auto stopped_at = cycles("Fast");
  EXPECT_EQ(sut_->ask(ControlVerb::single_cycle).code, ErrorCode::ok);
  EXPECT_EQ(cycles("Fast"), stopped_at + 1);
}

INSTANTIATE_TEST_SUITE_P(Schedulers, SingleCycleUnderEachScheduler,
                         ::testing::Values("CmpSchedule", "CmpScheduleTimer", "CmpScheduleOneShot"));

TEST_F(LifeInProcess, GoesToExceptionByASingleCycleThatDoesNotEnd) {
  start(5'000, {"--stopped", "--start-kind", "cold"});
  PacketSocket socket = sut_->connect();
  send(socket, ControlVerb::single_cycle, 4);
  ASSERT_TRUE(wait_for(ApplicationState::single_cycle));
  expect_refused(ControlVerb::start, ErrorCode::busy, "single cycle");
  const auto reply = receive(socket);
  EXPECT_EQ(reply.code, ErrorCode::timed_out);
  EXPECT_THAT(reply.text, HasSubstr("Other (after 5000 ms)"));
  ASSERT_EQ(exceptions().size(), 1U);
  expect_stop_timeout(exceptions()[0], "Other", 5'000, "a single cycle");
  EXPECT_EQ(cycles("Output"), 1U);
  EXPECT_EQ(cycles("Free"), 0U);  // its turn comes after Other
  expect_exception_of("Other");
}

TEST_F(LifeInProcess, TellsWhichTasksHadNoTurnInASingleCycle) {
  ::setenv("PLC_HOLD_MS", "50", 1);
  ControlReply reply;
  // It has its turn if the control thread looks later than the hold ends.
  EXPECT_TRUE(eventually([&] {
    start(1, {"--stopped", "--start-kind", "cold"});
    reply = sut_->ask(ControlVerb::single_cycle);
    return reply.text ==
           "the single cycle was over after 1 ms (Stop.OthersLimitMs) before the turn of task Free";
  })) << reply.text;
  ::unsetenv("PLC_HOLD_MS");
  EXPECT_EQ(reply.code, ErrorCode::timed_out);
  EXPECT_EQ(cycles("Other"), 1U);
  EXPECT_EQ(cycles("Free"), 0U);
  EXPECT_EQ(state(), ApplicationState::stopped);
}

TEST_F(LifeInProcess, IsStoppedWithinASingleCycle) {
  start(5'000, {"--stopped", "--start-kind", "cold"});
  PacketSocket socket = sut_->connect();
  send(socket, ControlVerb::single_cycle, 4);
  ASSERT_TRUE(wait_for(ApplicationState::single_cycle));
  PacketSocket other = sut_->connect();
  send(other, ControlVerb::stop, 5);
  EXPECT_EQ(receive(socket).code, ErrorCode::wrong_state);  // broken off
  EXPECT_EQ(receive(other).code, ErrorCode::timed_out);     // Other does not come back
  expect_exception_of("Other");
}

TEST_F(LifeInProcess, TellsTheApplicationWhyItStarts) {
  for (const auto& [kind, number] :
       {std::pair("first", 0), std::pair("warm", 1), std::pair("cold", 2), std::pair("after-fault", 3)}) {
    start(200, {"--stopped", "--start-kind", kind});
    EXPECT_THAT(sut_->log(), HasSubstr(fmt::format("start kind {}", number)));
    EXPECT_EQ(sut_->end(SIGTERM), EXIT_SUCCESS);
  }
}

TEST_F(LifeInProcess, IsWrittenDownTransitionByTransition) {
  start(200, {"--stopped"});
  auto reader = TransitionRingReader::open(sandbox_.pool(), "line1");
  ASSERT_TRUE(reader);
  for (const ControlVerb verb : {ControlVerb::single_cycle, ControlVerb::start, ControlVerb::stop}) {
    EXPECT_EQ(sut_->ask(verb).code, ErrorCode::ok);
  }
  EXPECT_EQ(sut_->ask(ControlVerb::stop).code, ErrorCode::wrong_state);
  EXPECT_EQ(sut_->ask(ControlVerb::start).code, ErrorCode::ok);
  hold("Other");
  EXPECT_EQ(sut_->ask(ControlVerb::stop).code, ErrorCode::timed_out);
  std::vector<std::uint64_t> numbers;
  std::vector<ApplicationState> states;
  std::string last_reason;
  while (const auto next = reader->next(MonotonicClock::now())) {
    EXPECT_EQ(next->pid, sut_->pid());
    numbers.push_back(next->sequence);
    states.push_back(static_cast<ApplicationState>(next->to));
    last_reason = next->reason.view();
  }
  using enum ApplicationState;
  EXPECT_THAT(states, ElementsAre(stopped, single_cycle, stopped, running, stopping, stopped, running,
                                  stopping, exception));
  for (std::size_t i = 0; i < numbers.size(); ++i) EXPECT_EQ(numbers[i], i + 1);
  EXPECT_THAT(last_reason, HasSubstr("stop_timeout"));
}

}  // namespace
}  // namespace plchost::testing
