#include <csignal>
#include <filesystem>
#include <fstream>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "manager/api_server.hpp"
#include "manager/supervisor/managed_instance.hpp"
#include "shm/pages/exception_history.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/pool/object_pool.hpp"
#include "shm/threads/thread.hpp"
#include "tests/integration/manager/costs_cycles.hpp"
#include "tests/integration/manager/plant.hpp"
#include "tests/support/sanitized.hpp"
#include "tests/support/stranger.hpp"

namespace plchost {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

void kill_process(int pid) {
  auto process = open_process(pid);
  ASSERT_TRUE(process);
  ASSERT_TRUE(signal_process(*process, SIGKILL));
}

TEST(Manager, StartsInOrderAndLeavesNothingBehindWhenItIsStopped) {
  Plant plant;
  plant.add("packer1", "packer", "after = [\"line1\"]");
  plant.add("line1", "bottling_line", "after = [\"drive1\"]\nscheduler = \"CmpScheduleTimer\"");
  plant.add("drive1", "drive_axis");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("packer1", InstanceState::running));
  const InstanceStatus line = plant.status("line1");
  EXPECT_EQ(line.state, InstanceState::running);
  EXPECT_EQ(line.core, 0);
  EXPECT_EQ(line.scheduler.view(), "CmpScheduleTimer");
  EXPECT_EQ(line.problem.view(), "");
  EXPECT_GT(line.pid, 0);
  EXPECT_LE(plant.status("drive1").state_since_unix_ns, line.state_since_unix_ns);
  EXPECT_LE(line.state_since_unix_ns, plant.status("packer1").state_since_unix_ns);
  EXPECT_TRUE(plant.wait_for_cycles("drive1"));
  EXPECT_EQ(plant.stop_manager().describe(), "exit code 0");
  EXPECT_THAT(plant.leftovers(), IsEmpty());
}

// The measure of the tests below sees a disturbance.
TEST(CostsCycles, OfAnInstanceThatIsHeldUp) {
  if (kSanitized) GTEST_SKIP() << "programs with a sanitizer lose cycles in calm, too";
  Plant plant;
  plant.add("drive1", "drive_axis");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("drive1", InstanceState::running));
  const int pid = plant.status("drive1").pid;
  const auto hold_up = [&](std::uint32_t) {
    ASSERT_EQ(::kill(pid, SIGSTOP), 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    ASSERT_EQ(::kill(pid, SIGCONT), 0);
  };
  std::vector<std::string> said;
  const auto are_seen = [&] {
    return costs_cycles(plant, "drive1", hold_up, [&](std::string_view round) { said.emplace_back(round); });
  };
  // A core that stands still for all of a pause hides that one.
  bool seen = are_seen();
  for (int more = 0; more < 4 && !seen; ++more) seen = are_seen();
  EXPECT_TRUE(seen) << fmt::format("{}", fmt::join(said, "\n"));
}

TEST(Manager, BringsAKilledInstanceBackWhileTheOthersGoOn) {
  Plant plant;
  plant.add("line1", "bottling_line", "crash_limit = 100\nrestart_delay_max_ms = 100");
  plant.add("drive1", "drive_axis");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  ASSERT_TRUE(plant.wait_for("drive1", InstanceState::running));
  const int other = plant.status("drive1").pid;
  EXPECT_FALSE(costs_cycles(plant, "drive1", [&](std::uint32_t kill) {
    const int pid = plant.status("line1").pid;
    kill_process(pid);
    EXPECT_TRUE(Plant::eventually([&] { return plant.status("line1").restarts == kill; }));
    EXPECT_TRUE(plant.wait_for("line1", InstanceState::running));
    EXPECT_NE(plant.status("line1").pid, pid);
    EXPECT_THAT(std::string(plant.status("line1").problem.view()), HasSubstr("killed by SIGKILL"));
  }));
  EXPECT_EQ(plant.status("drive1").pid, other);
  EXPECT_EQ(plant.status("drive1").restarts, 0U);
  EXPECT_TRUE(plant.wait_for_cycles("line1"));
}

TEST(Manager, BringsAnInstanceBackWhoseApplicationHasLeftAProcessBehind) {
  Plant plant;
  plant.add("line1", "fault_forks");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  kill_process(plant.status("line1").pid);
  ASSERT_TRUE(Plant::eventually([&] { return plant.status("line1").restarts > 0; }));
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  EXPECT_EQ(plant.status("line1").restarts, 1U);
  EXPECT_EQ(plant.stop_manager().describe(), "exit code 0");
  EXPECT_THAT(plant.leftovers(), IsEmpty());
}

TEST(Manager, PutsACrashLoopIntoSafeModeUntilAnotherApplicationIsLoaded) {
  Plant plant;
  plant.add("line1", "manager_crash_soon", "restart_delay_ms = 1\ncrash_limit = 3");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::safe_mode));
  EXPECT_THAT(std::string(plant.status("line1").problem.view()), HasSubstr("the last: killed by SIGSEGV"));
  const auto loaded = plant.ask(ControlVerb::load_application, "line1", Plant::application("bottling_line"));
  EXPECT_EQ(loaded.code, ErrorCode::ok) << loaded.text;
  EXPECT_EQ(plant.status("line1").state, InstanceState::running);
  EXPECT_TRUE(plant.wait_for_cycles("line1"));
}

// A program that the instance's settings do not allow fails its trial: the machine runs on.
TEST(Manager, RefusesAnApplicationThatTheSettingsDoNotAllowBeforeItEndsTheOneThatRuns) {
  Plant plant;
  plant.add("line1", "bottling_line", "settings = \"line1.cfg\"");
  plant.write_file("line1.cfg", "[Task.Conveyor]\nLatePolicy=Asap\n");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  const int pid = plant.status("line1").pid;
  const auto reply = plant.ask(ControlVerb::load_application, "line1", Plant::application("drive_axis"));
  EXPECT_EQ(reply.code, ErrorCode::invalid_argument);
  EXPECT_THAT(reply.text, HasSubstr("the application has no task 'Conveyor'"));
  EXPECT_EQ(plant.status("line1").pid, pid);
  EXPECT_TRUE(plant.wait_for_cycles("line1"));
}

TEST(Manager, StartsTheApplicationBeforeAgainWhenTheNewOneDoesNotComeUp) {
  Plant plant;
  plant.add("line1", "bottling_line");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  const int pid = plant.status("line1").pid;
  const auto reply =
      plant.ask(ControlVerb::load_application, "line1", Plant::application("manager_fails_at_start"));
  EXPECT_EQ(reply.code, ErrorCode::unavailable);
  EXPECT_THAT(reply.text, HasSubstr("plc_app_init returned 1"));
  EXPECT_THAT(reply.text, HasSubstr("which was loaded before, is started again"));
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  EXPECT_NE(plant.status("line1").pid, pid);
  EXPECT_EQ(plant.status("line1").application.view(), Plant::application("bottling_line"));
  EXPECT_TRUE(plant.wait_for_cycles("line1"));
}

TEST(Manager, LeadsOutOfAFaultThatHoldsTheHeapAsOutOfAnyOther) {
  if (kSanitized) GTEST_SKIP() << "the sanitizer's own heap ends the process";
  Plant plant;
  plant.add("line1", "manager_double_free");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::exception));
  const int pid = plant.status("line1").pid;
  EXPECT_THAT(std::string(plant.status("line1").problem.view()),
              StartsWith("task 'DoubleFree': SIGABRT: abort; its control thread has not"));
  const auto kept = read_exceptions(exception_path(plant.run_directory(), "line1"));
  ASSERT_TRUE(kept);
  ASSERT_EQ(kept->entries.size(), 1U);
  EXPECT_EQ(kept->entries[0].task, "DoubleFree");
  EXPECT_EQ(kept->entries[0].signal, "SIGABRT");
  EXPECT_NE(kept->entries[0].address, 0U);
  EXPECT_TRUE(kept->entries[0].back_trace.empty());
  EXPECT_THAT(kept->entries[0].back_trace_end, StartsWith("only its process knew it"));
  EXPECT_THAT(kept->entries[0].activity, Contains(HasSubstr("DoubleFree: start, ")));
  EXPECT_GT(kept->entries[0].unix_ns, 0);
  EXPECT_EQ(plant.ask(ControlVerb::start, "line1").code, ErrorCode::wrong_state);
  const TimePoint before = MonotonicClock::now();
  EXPECT_EQ(plant.ask(ControlVerb::reset, "line1").code, ErrorCode::ok);
  EXPECT_LT(MonotonicClock::now() - before, kShutdownLimit) << "it cannot be asked to end";
  EXPECT_EQ(plant.status("line1").state, InstanceState::stopped);
  EXPECT_NE(plant.status("line1").pid, pid);
}

TEST(Manager, KeepsTheExceptionOfAProcessThatEndsBeforeItHasWrittenIt) {
  if (kSanitized) GTEST_SKIP() << "the sanitizer's own heap ends the process";
  Plant plant;
  plant.add("line1", "manager_double_free");
  plant.start_manager();
  std::int64_t caught_at = 0;
  ASSERT_TRUE(Plant::eventually([&] {
    const auto page = InstancePageReader::open(plant.pool(), "line1");
    const auto fault = page ? page->fault(0) : std::nullopt;
    caught_at = fault ? fault->unix_ns : 0;
    return caught_at != 0;
  }));
  kill_process(plant.status("line1").pid);
  EXPECT_TRUE(Plant::eventually([&] {
    const auto kept = read_exceptions(exception_path(plant.run_directory(), "line1"));
    return kept && !kept->entries.empty() && kept->entries[0].unix_ns == caught_at;
  }));
}

// The supervision is below that thread, and no signal reaches it: the instance finds it by itself if the
// kernel leaves some time to threads without real-time priority. Else it does not answer the manager.
TEST(Manager, RestartsAnInstanceSoonWhoseApplicationTakesTheProcessor) {
  if (!Thread::start("probe", {.fifo = 1}, [] {})) GTEST_SKIP() << "no right to SCHED_FIFO";
  Plant plant;
  plant.add("line1", "manager_processor_taker");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::exception));
  const int pid = plant.status("line1").pid;
  const TimePoint before = MonotonicClock::now();
  EXPECT_EQ(plant.ask(ControlVerb::restart, "line1").code, ErrorCode::ok);
  EXPECT_LT(MonotonicClock::now() - before, kTerminateLimit * 5) << "nobody waits for its cycles";
  EXPECT_NE(plant.status("line1").pid, pid);
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  EXPECT_TRUE(plant.wait_for_cycles("line1", 50)) << "it runs as it would have";
}

// Its set-up does not return, and nothing of the runtime gets its core.
TEST(Manager, NamesTheThreadThatTakesTheProcessorInTheSetUpAndFreesTheCore) {
  if (!Thread::start("probe", {.fifo = 1}, [] {})) GTEST_SKIP() << "no right to SCHED_FIFO";
  Plant plant;
  plant.add("line1", "manager_setup_hog");
  plant.add("line2", "manager_setup_taker");
  plant.add("line3", "bottling_line", "scheduler = \"CmpScheduleTimer\"");
  plant.add("line4", "fault_loops");
  plant.start_manager();
  const auto problem = [&](const char* name) { return std::string(plant.status(name).problem.view()); };
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::failed));
  EXPECT_THAT(problem("line1"), HasSubstr("load application: in the set-up, thread 'hog' (SCHED_FIFO 60) "
                                          "took the processor for "));
  ASSERT_TRUE(plant.wait_for("line2", InstanceState::failed));
  EXPECT_THAT(problem("line2"), HasSubstr("in the set-up, thread 'plc-instance' (SCHED_FIFO 60) took the "));
  ASSERT_TRUE(plant.wait_for("line3", InstanceState::running));
  EXPECT_EQ(plant.status("line3").restarts, 0U);
  EXPECT_TRUE(plant.wait_for_cycles("line3"));
  EXPECT_EQ(plant.status("line1").pid, 0);
  EXPECT_EQ(plant.status("line1").restarts, 0U) << "it would do the same again";
  // Time in which others have its core does not count.
  ASSERT_TRUE(Plant::within(std::chrono::seconds(100),
                            [&] { return plant.status("line4").state == InstanceState::failed; }));
  EXPECT_THAT(problem("line4"), HasSubstr("load application: the set-up has not returned for 25 s"));
}

// So that its control thread always has something to do: a thread that sometimes sleeps gets the little
// time that the kernel leaves to threads without real-time priority.
class BusyAsker {
 public:
  explicit BusyAsker(const Plant& plant)
      : thread_([path = instance_socket_path(plant.run_directory(), "line1")](const std::stop_token& stop) {
          ControlRequest request;
          request.verb = ControlVerb::status;
          request.instance = "line1";
          const std::string question = encode(request);
          auto socket = PacketSocket::connect(path);
          while (socket && !stop.stop_requested()) {
            if (!socket->send(question)) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // full
            for (auto answer = socket->receive(); answer && *answer;) answer = socket->receive();
          }
        }) {}

 private:
  std::jthread thread_;
};

// A program at the lowest real-time priority keeps the control thread from its core, and no task.
TEST(Manager, NamesTheProgramThatKeepsAnInstanceFromAnsweringAndLetsItRun) {
  if (!Thread::start("probe", {.fifo = 1}, [] {})) GTEST_SKIP() << "no right to SCHED_FIFO";
  Plant plant;
  plant.add("line1", "bottling_line");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  const InstanceStatus before = plant.status("line1");
  const auto problem = [&] { return std::string(plant.status("line1").problem.view()); };
  Stranger::make_modest(before.pid, true);
  {
    const BusyAsker asker(plant);
    const Stranger stranger(before.core, 1);
    const std::string words = fmt::format("program 'stranger' (process {}, SCHED_FIFO 1)", stranger.pid());
    EXPECT_TRUE(Plant::eventually([&] { return problem().find(words) != std::string::npos; })) << problem();
    std::this_thread::sleep_for(HeartbeatWatch::kLimit + std::chrono::seconds(1));
    EXPECT_EQ(plant.status("line1").state, InstanceState::running) << problem();
    EXPECT_TRUE(plant.wait_for_cycles("line1")) << "its tasks are above that program";
  }
  Stranger::make_modest(before.pid, false);
  EXPECT_TRUE(Plant::eventually([&] { return problem().empty(); })) << problem();
  EXPECT_EQ(plant.status("line1").pid, before.pid);
  EXPECT_EQ(plant.status("line1").restarts, 0U);
  EXPECT_EQ(plant.status("line1").state_since_unix_ns, before.state_since_unix_ns);
  EXPECT_EQ(plant.ask(ControlVerb::stop, "line1").code, ErrorCode::ok);
}

// Another program with the right to write the pool, and a process that stands still afterwards.
class DamagedPage : public testing::TestWithParam<bool> {};

TEST_P(DamagedPage, IsNoFaultOfTheInstanceAndHidesNone) {
  const bool cut = GetParam();
  Plant plant;
  plant.add("line1", "bottling_line");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  const int pid = plant.status("line1").pid;
  const std::string page = MemoryFile::path(instance_page_name(plant.pool(), "line1"));
  if (cut) {
    std::filesystem::resize_file(page, std::filesystem::file_size(page) / 2);
  } else {
    std::fstream(page, std::ios::in | std::ios::out | std::ios::binary) << std::string(4096, '\xa5');
  }
  EXPECT_TRUE(
      Plant::eventually([&] { return plant.log().find("page of this instance was") != std::string::npos; }));
  if (cut) {
    EXPECT_TRUE(Plant::eventually([&] {
      return plant.status("line1").problem.view().find("damaged its status page") != std::string_view::npos;
    }));
  }
  std::this_thread::sleep_for(HeartbeatWatch::kLimit + std::chrono::seconds(2));
  EXPECT_EQ(plant.status("line1").state, InstanceState::running);
  EXPECT_EQ(plant.status("line1").pid, pid);
  if (!cut) {
    EXPECT_TRUE(plant.wait_for_cycles("line1")) << "the page is whole again";
  }
  ASSERT_EQ(::kill(pid, SIGSTOP), 0);
  EXPECT_TRUE(plant.wait_for("line1", InstanceState::exception));
  EXPECT_THAT(std::string(plant.status("line1").problem.view()), HasSubstr("has not answered"));
  ASSERT_EQ(::kill(pid, SIGCONT), 0);
  EXPECT_TRUE(plant.wait_for("line1", InstanceState::running));
  EXPECT_EQ(plant.ask(ControlVerb::restart, "line1").code, ErrorCode::ok);
  EXPECT_NE(plant.status("line1").pid, pid);
  EXPECT_TRUE(plant.wait_for_cycles("line1"));
  EXPECT_EQ(plant.stop_manager().describe(), "exit code 0");
  EXPECT_THAT(plant.leftovers(), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(OverwrittenAndCut, DamagedPage, testing::Bool());

TEST(Manager, RefusesAWrongApplicationAndLeavesTheOldOneRunning) {
  Plant plant;
  plant.add("line1", "bottling_line");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  const int pid = plant.status("line1").pid;
  for (const std::string file : {"cell.toml", "/nowhere/x.so"}) {
    const auto refused = plant.ask(ControlVerb::load_application, "line1", file);
    EXPECT_NE(refused.code, ErrorCode::ok);
    EXPECT_THAT(refused.text, HasSubstr(file));
  }
  EXPECT_EQ(plant.status("line1").pid, pid);
  EXPECT_TRUE(plant.wait_for_cycles("line1"));
}

TEST(Manager, RefusesAnApplicationThatEndsItsTrialAsIfAllWereWell) {
  Plant plant;
  plant.add("line1", "bottling_line");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  const int pid = plant.status("line1").pid;
  const ControlReply reply =
      plant.ask(ControlVerb::load_application, "line1", Plant::application("fault_exits"));
  EXPECT_EQ(reply.code, ErrorCode::invalid_argument);
  EXPECT_THAT(reply.text, HasSubstr("it ends its process in its set-up"));
  EXPECT_EQ(plant.status("line1").pid, pid);
}

TEST(Manager, SaysWhyAnInstanceCouldNotBeSetUp) {
  Plant plant;
  plant.write_file("line1.cfg", "[CmpSchedule]\nSchedulerInterval=soon\n");
  plant.add("line1", "bottling_line", "settings = \"line1.cfg\"");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::failed));
  EXPECT_THAT(std::string(plant.status("line1").problem.view()), HasSubstr("exit code 3: read settings: "));
}

TEST(Manager, CarriesOutEveryCommand) {
  Plant plant;
  plant.add("line1", "bottling_line");
  plant.start_manager();
  ASSERT_TRUE(plant.wait_for("line1", InstanceState::running));
  const auto expect_ok = [&](ControlVerb verb, const std::string& argument, InstanceState state) {
    const auto reply = plant.ask(verb, "line1", argument);
    EXPECT_EQ(reply.code, ErrorCode::ok) << to_string(verb) << ": " << reply.text;
    EXPECT_EQ(reply.number, 42U);
    EXPECT_EQ(plant.status("line1").state, state) << to_string(verb);
  };
  const int first = plant.status("line1").pid;
  expect_ok(ControlVerb::stop, "", InstanceState::stopped);
  expect_ok(ControlVerb::stop, "", InstanceState::stopped);
  expect_ok(ControlVerb::start, "", InstanceState::running);
  expect_ok(ControlVerb::start, "", InstanceState::running);
  expect_ok(ControlVerb::set_scheduler, "CmpScheduleOneShot", InstanceState::running);
  EXPECT_EQ(plant.status("line1").scheduler.view(), "CmpScheduleOneShot");
  expect_ok(ControlVerb::register_event, "by_hand", InstanceState::running);
  EXPECT_EQ(plant.status("line1").pid, first);
  expect_ok(ControlVerb::reset, "", InstanceState::stopped);
  EXPECT_NE(plant.status("line1").pid, first);
  EXPECT_EQ(plant.status("line1").scheduler.view(), "CmpScheduleOneShot");
  expect_ok(ControlVerb::unregister_event, "by_hand", InstanceState::stopped);
  expect_ok(ControlVerb::restart, "", InstanceState::running);
  EXPECT_TRUE(plant.wait_for_cycles("line1"));
  EXPECT_EQ(plant.status("line1").restarts, 0U);
  EXPECT_EQ(plant.ask(ControlVerb::stop, "line2").text, "no instance 'line2'; there are line1");
}

TEST(Manager, KeepsTheApiServerAliveAndEndsItWithItself) {
  Plant plant;
  plant.use_api_server("echo \"$$ $*\" >> api.log\nexec sleep 1000\n");
  plant.start_manager();
  const auto lines = [&] { return plant.lines_of("api.log"); };
  ASSERT_TRUE(Plant::eventually([&] { return lines().size() == 1; }));
  EXPECT_THAT(lines()[0], HasSubstr("--host cell --domain 0 --pool " + plant.pool() + " --run-directory "));
  EXPECT_THAT(lines()[0], HasSubstr("--interface lo --blocks-base blocks --host-number 0 --audit-folder "));
  kill_process(std::stoi(lines()[0]));
  ASSERT_TRUE(Plant::eventually([&] { return lines().size() == 2; }));
  const int second = std::stoi(lines()[1]);
  EXPECT_EQ(plant.stop_manager().describe(), "exit code 0");
  EXPECT_FALSE(open_process(second));
}

TEST(Manager, StartsAnApiServerThatHasServedAgainWithItsNameAndAlmostAtOnceHoweverOftenItDies) {
  Plant plant;
  plant.use_api_server(
      "arguments=\"$$ $*\"\nwhile [ \"$1\" != --beat-fd ]; do shift; done\n"
      "printf '\\1\\0\\0\\0\\0\\0\\0\\0' >&\"$2\"\necho \"$arguments\" >> api.log\nexec sleep 1000\n");
  plant.start_manager();
  const auto lines = [&] { return plant.lines_of("api.log"); };
  constexpr std::size_t kDeaths = 4;
  for (std::size_t i = 0; i < kDeaths; ++i) {
    ASSERT_TRUE(Plant::eventually([&] { return lines().size() == i + 1; }));
    kill_process(std::stoi(lines()[i]));
  }
  ASSERT_TRUE(Plant::eventually([&] { return lines().size() == kDeaths + 1; }));
  EXPECT_THAT(lines()[0], testing::Not(HasSubstr("--name-held")));
  for (std::size_t i = 1; i <= kDeaths; ++i) EXPECT_THAT(lines()[i], HasSubstr("--name-held"));
  EXPECT_THAT(plant.log(), HasSubstr("starts again after 50 ms"));
  EXPECT_THAT(plant.log(), testing::Not(HasSubstr("starts again after 100 ms")));
  EXPECT_EQ(plant.stop_manager().describe(), "exit code 0");
}

TEST(Manager, KillsAnApiServerWhoseLoopStandsStillAndNoOther) {
  Plant plant;
  plant.use_api_server(
      "echo $$ >> api.log\n"
      "until [ -e stands_still ]; do printf '\\001\\0\\0\\0\\0\\0\\0\\0' >&3; sleep 0.1; done\n"
      "exec sleep 1000\n");
  plant.start_manager();
  const auto lines = [&] { return plant.lines_of("api.log"); };
  ASSERT_TRUE(Plant::eventually([&] { return lines().size() == 1; }));
  std::this_thread::sleep_for(kApiSilence + std::chrono::seconds(1));
  EXPECT_EQ(lines().size(), 1U);
  plant.write_file("stands_still", "");
  EXPECT_TRUE(Plant::eventually([&] { return lines().size() == 2; }));
}

}  // namespace
}  // namespace plchost
