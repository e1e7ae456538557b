// Faults in the cycles of a real plc-instance: caught, recorded, and the instance stays reachable.
#include <csignal>
#include <cstdlib>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "shm/pages/exception_history.hpp"
#include "shm/threads/thread.hpp"
#include "tests/integration/instances/instance_process.hpp"

namespace plchost::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;

const std::string kWatchdogs =
    "[Task.Loop]\nWatchdog.TimeUs=20000\n"
    "[Task.Sleep]\nWatchdog.TimeUs=20000\n";

/// An instance whose tasks have faults on demand.
class Faulty {
 public:
  explicit Faulty(const std::string& settings = kWatchdogs, const std::string& scheduler = "CmpSchedule",
                  const std::string& at_start = {}, const std::string& band = "normal")
      : process_(sandbox_, arguments(settings, scheduler, at_start, band)) {
    if (at_start.empty()) process_.wait_until_up();
  }

  InstanceProcess& process() { return process_; }
  /// The exceptions that are kept, when there are as many. The thread that answers has written the names of
  /// their functions then.
  std::vector<ExceptionEntry> exceptions(std::size_t count = 1) {
    std::vector<ExceptionEntry> found;
    EXPECT_TRUE(eventually([&] {
      const auto history = read_exceptions(exception_path(sandbox_.folder(), "line1"));
      return history && history->entries.size() >= count;
    })) << process_.log();
    (void)process_.ask(ControlVerb::status);
    if (const auto named = read_exceptions(exception_path(sandbox_.folder(), "line1")))
      found = named->entries;
    found.resize(std::max(count, found.size()));
    return found;
  }
  PageTaskState state_of(const std::string& task) { return process_.task(task)->state; }
  std::uint64_t cycles_of(const std::string& task) { return process_.task(task)->counters.cycles; }
  bool runs(const std::string& task) {
    const auto before = cycles_of(task);
    return eventually([&] { return cycles_of(task) > before + 5; });
  }

 private:
  // All on one core, as it should be: so one task can starve another.
  [[nodiscard]] std::vector<std::string> arguments(const std::string& settings, const std::string& scheduler,
                                                   const std::string& at_start,
                                                   const std::string& band) const {
    ::setenv("PLC_FAULT_AT_START", at_start.c_str(), 1);
    return {"--core",          std::to_string(allowed_cores(0).value().back()),
            "--scheduler",     scheduler,
            "--priority-band", band,
            "--settings",      sandbox_.write("line1.cfg", settings),
            "--application",   application("task_faults")};
  }

  Sandbox sandbox_;
  InstanceProcess process_;
};

// Holds after every fault of the whole application.
void expect_stopped_and_reachable(Faulty& sut, const std::string& task) {
  EXPECT_TRUE(eventually([&] { return sut.state_of("Fast") == PageTaskState::stopped; }))
      << sut.process().log();
  EXPECT_EQ(sut.state_of(task), PageTaskState::exception);
  const auto cycles = sut.cycles_of("Fast");
  EXPECT_EQ(sut.process().ask(ControlVerb::status).code, ErrorCode::ok);
  const auto refused = sut.process().ask(ControlVerb::start);
  EXPECT_EQ(refused.code, ErrorCode::wrong_state);
  EXPECT_THAT(refused.text, AllOf(HasSubstr(task), HasSubstr("reset"), HasSubstr("first")));
  EXPECT_EQ(sut.cycles_of("Fast"), cycles);
  EXPECT_EQ(sut.process().end(SIGTERM), EXIT_SUCCESS) << sut.process().log();
}

struct Fault {
  const char* event;
  const char* task;
  const char* kind;
  const char* signal;
  const char* text;
  const char* symbol;
};

void PrintTo(const Fault& fault, std::ostream* to) {
  *to << fault.event;
}

class TaskWith : public ::testing::TestWithParam<Fault> {};

TEST_P(TaskWith, GoesToExceptionAndTheInstanceStaysReachable) {
  Faulty sut;
  (void)sut.process().event(GetParam().event).post();
  const auto exceptions = sut.exceptions();
  EXPECT_EQ(exceptions.front().number, 1U);
  EXPECT_EQ(exceptions.front().task, GetParam().task);
  EXPECT_EQ(exceptions.front().kind, GetParam().kind);
  EXPECT_EQ(exceptions.front().signal, GetParam().signal);
  EXPECT_THAT(exceptions.front().text, HasSubstr(GetParam().text));
  EXPECT_THAT(exceptions.front().symbol, HasSubstr(GetParam().symbol));
  EXPECT_THAT(exceptions.front().application, HasSubstr("task_faults.so"));
  EXPECT_TRUE(exceptions.front().whole_application);
  EXPECT_TRUE(exceptions.front().signal == "SIGSEGV" || exceptions.front().memory_address == 0);
  expect_stopped_and_reachable(sut, GetParam().task);
}

INSTANTIATE_TEST_SUITE_P(
    Faults, TaskWith,
    ::testing::Values(
        Fault{"divide", "Divide", "signal", "SIGFPE", "integer division by zero or overflow", "divide()+0x"},
        Fault{"read_null", "ReadNull", "signal", "SIGSEGV", "access to no memory at 0x0", "read_null()+0x"},
        Fault{"write_null", "WriteNull", "signal", "SIGSEGV", "access to no memory at 0x0",
              "write_null()+0x"},
        Fault{"call_null", "CallNull", "signal", "SIGSEGV", "at 0x0",
              "called from (anonymous namespace)::call_null()"},
        Fault{"recurse", "Recurse", "signal", "SIGSEGV", "stack overflow", "recurse(int)+0x"},
        Fault{"alloca", "Alloca", "signal", "SIGSEGV", "stack overflow", "overflow_at_once()+0x"},
        Fault{"abort", "Abort", "signal", "SIGABRT", "abort", ""},
        Fault{"illegal", "Illegal", "signal", "SIGILL", "illegal instruction", "task_faults.so"},
        Fault{"throw", "Throw", "cpp_exception", "", "std::runtime_error left its cycle: the valve is stuck",
              "setup(plc::Application&)"},
        Fault{"throw_deep", "ThrowDeep", "cpp_exception", "", "std::runtime_error left its cycle: deep",
              "throw_deep(int)"},
        Fault{"variable_throws", "Edge", "cpp_exception", "",
              "std::runtime_error left its event variable: deep", "throw_deep(int)"},
        Fault{"loop", "Loop", "task_watchdog", "", "the limit is 20.000 ms", "loop()+0x"},
        Fault{"sleep", "Sleep", "task_watchdog", "", "the limit is 20.000 ms", ""},
        Fault{"variable", "Edge", "signal", "SIGFPE",
              "integer division by zero or overflow in its event variable", "divide()+0x"}),
    [](const auto& test) { return std::string(test.param.event); });

/// The functions of the application in the back-trace of a fault, the innermost first, and how it ends.
struct Trace {
  const char* event;
  std::vector<std::string> functions;
  const char* end;
};

void PrintTo(const Trace& trace, std::ostream* to) {
  *to << trace.event;
}

class BackTraceOf : public ::testing::TestWithParam<Trace> {};

TEST_P(BackTraceOf, AFaultNamesTheFunctionsThatLedToIt) {
  Faulty sut;
  (void)sut.process().event(GetParam().event).post();
  const ExceptionEntry found = sut.exceptions().front();
  std::vector<std::string> own;
  for (const std::string& function : found.back_trace) {
    EXPECT_LE(function.size(), 255U);
    if (function.find("task_faults.so") != std::string::npos) own.push_back(function);
  }
  const std::vector<std::string>& expected = GetParam().functions;
  ASSERT_GE(own.size(), expected.size()) << ::testing::PrintToString(found.back_trace);
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_THAT(own[i], HasSubstr(expected[i]));
  EXPECT_EQ(found.back_trace_end, GetParam().end) << ::testing::PrintToString(found.back_trace);
  EXPECT_EQ(::testing::PrintToString(found.back_trace).find("Task::run_cycle"), std::string::npos);
}

const std::vector<Trace> kTraces = {
    {"nested", {"innermost()+0x", "middle()+0x", "outermost()+0x"}, ""},
    {"long_name", {"innermost()+0x", "...+0x"}, ""},
    {"recurse", std::vector<std::string>(32, "recurse(int)+0x"), "only the innermost 32 functions are known"},
    {"alloca", {"overflow_at_once()+0x"}, ""},
    {"abort", {"setup(plc::Application&)"}, ""},
    {"loop", {"loop()+0x"}, ""},
    {"sleep", {"sleep_for_ever()+0x"}, ""},
    {"variable", {"divide()+0x", "setup(plc::Application&)"}, ""},
    {"call_null", {"call_null()+0x"}, ""},
    {"throw", {"setup(plc::Application&)"}, ""},
    {"throw_deep", {"throw_deep(int)", "throw_deep(int)", "throw_deep(int)", "throw_after_a_catch()+0x"}, ""},
    {"throw_again", {"throw_again()"}, ""},
    {"throw_many_times", std::vector<std::string>(32, "throw_deep(int)"),
     "only the innermost 32 functions are known"},
    {"variable_throws", {"throw_deep(int)", "throw_deep(int)", "setup(plc::Application&)"}, ""},
#if defined(__x86_64__)  // which has return addresses on the stack only
    {"smash_stack",
     {"smash_stack()+0x"},
     "the caller of the last function is not known: it has no unwind tables, or the stack is overwritten"},
    {"lose_frame", {"lose_frame()+0x"}, "the stack is overwritten: it leads to memory that cannot be read"},
#endif
};

INSTANTIATE_TEST_SUITE_P(Faults, BackTraceOf, ::testing::ValuesIn(kTraces),
                         [](const auto& test) { return std::string(test.param.event); });

TEST(TaskException, TellsFileAndLineOfEachFunctionWithDebugInformation) {
  Faulty sut;
  (void)sut.process().event("throw_deep").post();
  const ExceptionEntry found = sut.exceptions().front();
  EXPECT_THAT(found.symbol,
              ::testing::ContainsRegex(
                  R"(throw_deep\(int\).*\+0x[0-9a-f]+ in task_faults.so at task_faults.cpp:[0-9]+$)"));
  std::vector<std::string> lines;
  for (const std::string& function : found.back_trace) {
    if (function.find("throw_deep(int)") != std::string::npos)
      lines.push_back(function.substr(function.rfind(':')));
  }
  ASSERT_EQ(lines.size(), 3U) << ::testing::PrintToString(found.back_trace);
  EXPECT_NE(lines[0], lines[1]) << "one throws, the others call";
  EXPECT_EQ(lines[1], lines[2]);
}

TEST(TaskException, TellsItsCircumstances) {
  Faulty sut("[Task.Divide]\nWatchdog.TimeUs=20000\nWatchdog.Sensitivity=2\n");
  (void)sut.process().event("divide").post();
  const ExceptionEntry found = sut.exceptions().front();
  EXPECT_EQ(found.circumstances.scheduler, "CmpSchedule");
  EXPECT_THAT(found.circumstances.settings,
              AllOf(HasSubstr("external, priority 4, core "),
                    HasSubstr(", watchdog 20 ms x 2, a fault stops the application")));
  EXPECT_NE(found.circumstances.version, "");
  EXPECT_THAT(found.circumstances.build, HasSubstr("build ID "));
  EXPECT_EQ(found.circumstances.cycles, 0U);
  EXPECT_GT(found.circumstances.uptime_ns, 0);
}

TEST(TaskException, TellsTheLastCyclesAndEventsOfAllTasks) {
  Faulty sut(kWatchdogs);
  (void)sut.process().event("divide").post();
  const ExceptionEntry found = sut.exceptions().front();
  const auto begins = [](const char* words) {
    return ::testing::ContainsRegex(std::string(R"(^-[0-9]+\.[0-9]+ ms )") + words);
  };
  EXPECT_THAT(found.activity, ::testing::Contains(begins("Divide: takes post 1")));
  EXPECT_THAT(found.activity, ::testing::Contains(begins("Divide: start, ")));
  EXPECT_THAT(found.activity, Not(::testing::Contains(begins("Divide: end"))))
      << "it did not come to its end";
  EXPECT_THAT(found.activity.back(), HasSubstr("runtime: exception, signal of Divide"));
}

class EachScheduler : public ::testing::TestWithParam<const char*> {};

TEST_P(EachScheduler, StopsALoopInTheFirstCycle) {
  Faulty sut("[Task.FirstLoop]\nWatchdog.TimeUs=10000\nWatchdog.Sensitivity=2\n", GetParam(), "loop");
  EXPECT_THAT(sut.exceptions().front().text, HasSubstr("the limit is 20.000 ms"));
  expect_stopped_and_reachable(sut, "FirstLoop");
}

TEST_P(EachScheduler, CatchesAFaultInTheFirstCycle) {
  Faulty sut(kWatchdogs, GetParam(), "divide");
  EXPECT_EQ(sut.exceptions().front().signal, "SIGFPE");
  expect_stopped_and_reachable(sut, "FirstDivide");
}

TEST_P(EachScheduler, CatchesAFaultInAnEventVariableWhenItIsFirstRead) {
  Faulty sut(kWatchdogs, GetParam(), "variable");
  EXPECT_THAT(sut.exceptions().front().text, HasSubstr("in its event variable"));
  expect_stopped_and_reachable(sut, "FirstVariable");
}

TEST_P(EachScheduler, CatchesAFaultInAnEventVariableLaterOn) {
  Faulty sut(kWatchdogs, GetParam());
  (void)sut.process().event("variable").post();
  EXPECT_EQ(sut.exceptions().front().task, "Edge");
  expect_stopped_and_reachable(sut, "Edge");
}

TEST_P(EachScheduler, StopsALoopInALaterCycle) {
  Faulty sut(kWatchdogs, GetParam());
  (void)sut.process().event("loop").post();
  EXPECT_THAT(sut.exceptions().front().symbol, HasSubstr("loop()+0x"));
  expect_stopped_and_reachable(sut, "Loop");
}

TEST_P(EachScheduler, HitsAtTheTwentiethOverrunInARow) {
  for (int round = 0;; ++round) {
    Faulty sut("[Task.Later]\nWatchdog.TimeUs=2000\nWatchdog.Sensitivity=20\n", GetParam());
    EXPECT_TRUE(sut.runs("Later"));
    (void)sut.process().event("overrun").post();
    const auto found = sut.exceptions().front();
    // A core that stands still within a cycle makes that one too long at once.
    if (found.kind == "task_watchdog" && round < 4) continue;
    EXPECT_EQ(found.kind, "consecutive_overruns");
    EXPECT_THAT(found.text, HasSubstr("20 cycles in a row took longer than 2.000 ms"));
    return expect_stopped_and_reachable(sut, "Later");
  }
}

TEST_P(EachScheduler, SeesACycleThatNeverRan) {
  Faulty sut("[Task.Low]\nWatchdog.OmittedCycles=10\n", GetParam());
  EXPECT_TRUE(sut.runs("Low"));
  std::this_thread::sleep_for(300ms);  // cycles right after a start are not counted
  (void)sut.process().event("starve").post();
  const auto found = sut.exceptions().front();
  EXPECT_EQ(found.kind, "omitted_cycles");
  EXPECT_EQ(found.task, "Low");
  expect_stopped_and_reachable(sut, "Low");
}

INSTANTIATE_TEST_SUITE_P(Each, EachScheduler,
                         ::testing::Values("CmpSchedule", "CmpScheduleTimer", "CmpScheduleOneShot"),
                         [](const auto& test) { return std::string(test.param); });

#if defined(__x86_64__)
TEST(TaskException, AThreadMadeInACycleHasNotItsPriority) {
  Faulty sut;
  sut.process().event("soft_hog").post();
  EXPECT_TRUE(eventually([&] { return sut.process().task("SoftHog")->counters.cycles == 1; }));
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(sut.runs("Fast"));
    EXPECT_TRUE(sut.runs("Low"));
  }
  EXPECT_EQ(sut.process().ask(ControlVerb::stop).code, ErrorCode::ok);
  EXPECT_EQ(sut.process().end(SIGTERM), EXIT_SUCCESS) << sut.process().log();
}

// Its thread asks for a priority of its own: below the thread that watches the tasks, above it, above all;
// one that blocks signals; and two of them.
class AThreadThatTakesTheProcessor : public ::testing::TestWithParam<const char*> {};

TEST_P(AThreadThatTakesTheProcessor, LosesItAndPutsTheApplicationIntoException) {
  if (!Thread::start("probe", {.fifo = 1}, [] {})) GTEST_SKIP() << "no right to SCHED_FIFO";
  Faulty sut("[CmpSchedule]\nWatchdog.DefaultTimeMs=600\n");
  sut.process().event(GetParam()).post();
  const ExceptionEntry exception = sut.exceptions().front();
  EXPECT_EQ(exception.kind, "no_processor");
  EXPECT_THAT(exception.text,
              AllOf(HasSubstr("thread 'hog' (SCHED_FIFO "), HasSubstr("the limit is 300 ms")));
  EXPECT_TRUE(exception.whole_application);
  const std::string another = exception.task == "Later" ? "Fast" : "Later";  // each task may have starved
  EXPECT_TRUE(eventually([&] { return sut.state_of(another) == PageTaskState::stopped; }));
  EXPECT_EQ(sut.state_of(exception.task), PageTaskState::exception);
  EXPECT_EQ(sut.process().ask(ControlVerb::status).code, ErrorCode::ok);
  EXPECT_EQ(sut.process().ask(ControlVerb::start).code, ErrorCode::wrong_state);
  EXPECT_EQ(sut.process().end(SIGTERM), EXIT_SUCCESS) << sut.process().log();
}

INSTANTIATE_TEST_SUITE_P(Each, AThreadThatTakesTheProcessor,
                         ::testing::Values("hog", "high_hog", "highest_hog", "deaf_hog", "two_hogs"),
                         [](const auto& test) { return std::string(test.param); });

TEST(TaskException, IsNoneOfAThreadThatTakesTheProcessorWhileNoTaskRuns) {
  if (!Thread::start("probe", {.fifo = 1}, [] {})) GTEST_SKIP() << "no right to SCHED_FIFO";
  Faulty sut("[CmpSchedule]\nWatchdog.DefaultTimeMs=600\n");
  sut.process().event("late_hog").post();
  EXPECT_TRUE(eventually([&] { return sut.process().task("LateHog")->counters.cycles == 1; }));
  EXPECT_EQ(sut.process().ask(ControlVerb::stop).code, ErrorCode::ok);
  EXPECT_TRUE(eventually([&] {
    return sut.process().log().find("from all threads of the runtime") != std::string::npos;
  })) << sut.process().log();
  EXPECT_THAT(sut.process().log(), HasSubstr("thread 'hog' (SCHED_FIFO 60) took the processor for "));
  EXPECT_EQ(sut.process().ask(ControlVerb::start).code, ErrorCode::ok) << "it takes nothing any more";
  EXPECT_TRUE(sut.runs("Low"));
  EXPECT_EQ(sut.process().end(SIGTERM), EXIT_SUCCESS) << sut.process().log();
}

TEST(TaskException, IsNoneOfALongCycleThatAStopWaitsFor) {
  Faulty sut("[CmpSchedule]\nWatchdog.DefaultTimeMs=600\n[Task.Compute]\nWatchdog.TimeUs=20000000\n");
  sut.process().event("compute").post();
  ASSERT_TRUE(eventually([&] { return sut.process().event("computes").counted().count() == 1; }));
  EXPECT_EQ(sut.process().ask(ControlVerb::stop).code, ErrorCode::ok);
  EXPECT_EQ(sut.process().task("Compute")->counters.cycles, 1U);
  EXPECT_EQ(sut.process().log().find("took the processor"), std::string::npos) << sut.process().log();
  EXPECT_EQ(sut.process().log().find("programs outside"), std::string::npos) << sut.process().log();
  EXPECT_EQ(sut.process().ask(ControlVerb::start).code, ErrorCode::ok) << sut.process().log();
  EXPECT_EQ(sut.process().end(SIGTERM), EXIT_SUCCESS) << sut.process().log();
}

TEST(TaskException, IsNoneOfAThreadThatLoopsOnACoreOfItsOwn) {
  if (!Thread::start("probe", {.fifo = 1}, [] {})) GTEST_SKIP() << "no right to SCHED_FIFO";
  const auto cores = allowed_cores(0).value();
  if (cores.front() != 0 || cores.back() == 0) GTEST_SKIP() << "no two cores, or not the first one";
  Faulty sut("[CmpSchedule]\nWatchdog.DefaultTimeMs=600\n");
  sut.process().event("far_hog").post();
  const TimePoint end = MonotonicClock::now() + 1500ms;
  while (MonotonicClock::now() < end) EXPECT_TRUE(sut.runs("Fast"));
  EXPECT_EQ(sut.process().log().find("hog"), std::string::npos) << sut.process().log();
  EXPECT_EQ(sut.process().end(SIGTERM), EXIT_SUCCESS) << sut.process().log();
}

TEST(TaskException, OfAWildPointerDoesNotTakeItForANullPointer) {
  Faulty sut;
  (void)sut.process().event("write_wild").post();
  const auto exceptions = sut.exceptions();
  EXPECT_EQ(exceptions.front().text, "SIGSEGV: access through a wild pointer; its address is not known");
  EXPECT_EQ(exceptions.front().memory_address, 0U);
  EXPECT_THAT(exceptions.front().symbol, HasSubstr("write_wild()+0x"));
}

TEST(TaskException, IsNoneOfABreakpointInAThreadOfTheApplicationWhichEndsTheProcess) {
  Faulty sut;
  (void)sut.process().event("break").post();
  EXPECT_EQ(sut.process().end(), -SIGTRAP);
}
#endif

TEST(TaskException, InTheMiddleOfALogLineStopsNoOtherLine) {
  Faulty sut("[Task.BadLog]\nWatchdog.Policy=Task\n");
  (void)sut.process().event("bad_log").post();
  EXPECT_EQ(sut.exceptions().front().task, "BadLog");
  (void)sut.process().event("say").post();
  EXPECT_TRUE(eventually([&] { return sut.process().log().find("application: said") != std::string::npos; }));
}

TEST(TaskException, OfATaskByItselfLeavesTheOthersRunning) {
  Faulty sut(
      "[Task.Divide]\nWatchdog.Policy=Task\n[Task.Loop]\nWatchdog.TimeUs=20000\nWatchdog.Policy=Task\n");
  (void)sut.process().event("divide").post();
  EXPECT_FALSE(sut.exceptions().front().whole_application);
  EXPECT_TRUE(sut.runs("Low"));
  EXPECT_TRUE(eventually([&] { return sut.process().event("divide").bound_tasks() == 0; }));
  EXPECT_EQ(sut.process().event("divide").post(), PostResult::no_task) << "nothing runs it any more";
  EXPECT_EQ(sut.process().event("loop").bound_tasks(), 1U);
  (void)sut.process().event("loop").post();
  EXPECT_EQ(sut.exceptions(2).back().task, "Loop");
  EXPECT_TRUE(sut.runs("Low"));
  EXPECT_EQ(sut.state_of("Divide"), PageTaskState::exception);
  EXPECT_EQ(sut.state_of("Low"), PageTaskState::running);
  EXPECT_EQ(sut.process().ask(ControlVerb::set_scheduler, "CmpScheduleTimer").code, ErrorCode::ok);
  EXPECT_TRUE(sut.runs("Low"));
  EXPECT_EQ(sut.process().ask(ControlVerb::stop).code, ErrorCode::ok);
  EXPECT_EQ(sut.process().ask(ControlVerb::start).code, ErrorCode::wrong_state);
  EXPECT_EQ(sut.process().end(SIGTERM), EXIT_SUCCESS);
}

TEST(TaskException, OfTheLoadNamesTheTaskThatUsedTheMost) {
  Faulty sut("[CmpSchedule]\nProcessorLoad.Enable=1\nProcessorLoad.Maximum=70\nProcessorLoad.Interval=200\n");
  std::this_thread::sleep_for(500ms);
  EXPECT_EQ(sut.state_of("Later"), PageTaskState::running);
  (void)sut.process().event("busy").post();
  const auto found = sut.exceptions().front();
  EXPECT_EQ(found.kind, "processor_load");
  EXPECT_EQ(found.task, "Later");
  expect_stopped_and_reachable(sut, "Later");
}

// An interval that is shorter than its task's cost: no cycle is long, and nobody below gets the core. In the
// band below that of the tests that run beside this one.
TEST(TaskException, OfAnOverloadEndsATaskThatNeverLeavesTheCore) {
  for (const char* const scheduler : {"CmpScheduleTimer", "CmpScheduleOneShot"}) {
    Faulty sut("[CmpSchedule]\nWatchdog.DefaultTimeMs=100\n", scheduler, "overload", "low");
    const auto found = sut.exceptions().front();
    EXPECT_EQ(found.kind, "processor_load");
    EXPECT_EQ(found.task, "Overload");
    EXPECT_THAT(found.text, HasSubstr("90"));
    expect_stopped_and_reachable(sut, "Overload");
  }
}

TEST(TaskException, IsKeptWhenTheProcessIsGoneAndCounted) {
  const Sandbox sandbox;
  for (unsigned i = 1; i <= ExceptionHistory::kMaxEntries / 8; ++i) {
    InstanceProcess sut(sandbox, {"--application", application("task_faults")});
    sut.wait_until_up();
    (void)sut.event("divide").post();
    EXPECT_TRUE(eventually([&] {
      const auto history = read_exceptions(exception_path(sandbox.folder(), "line1"));
      return history && history->count == i && history->entries.size() == i;
    })) << sut.log();
    EXPECT_EQ(sut.end(SIGKILL), -SIGKILL);
  }
}

TEST(TaskException, DefaultGuardStopsAnEndlessLoopAndCanBeOff) {
  Faulty sut("[CmpSchedule]\nWatchdog.DefaultTimeMs=100\n");
  (void)sut.process().event("loop").post();
  EXPECT_THAT(sut.exceptions().front().text, HasSubstr("the limit is 100.000 ms"));
  Faulty off("[CmpSchedule]\nWatchdog.DefaultTimeMs=0\n");
  (void)off.process().event("sleep").post();
  EXPECT_TRUE(off.runs("Low"));
  std::this_thread::sleep_for(200ms);
  EXPECT_TRUE(off.runs("Low"));
  EXPECT_EQ(off.state_of("Sleep"), PageTaskState::running);
}

}  // namespace
}  // namespace plchost::testing
