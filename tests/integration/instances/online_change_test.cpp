// Another version of an application takes over in a real plc-instance, while the tasks run.
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "shm/pages/exception_history.hpp"
#include "shm/threads/thread.hpp"
#include "tests/integration/instances/instance_process.hpp"
#include "tests/support/receive_until.hpp"

namespace plchost::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// The program's report of itself.
struct VersionReport {
  int version = 0;
  unsigned long counter = 0;  ///< a variable that it keeps
  unsigned long area = 0;
  unsigned long kept = 0;   ///< a retain variable
  unsigned long fresh = 0;  ///< a static variable that it does not keep
  unsigned long works = 0;
  int own_figures = 0;
  int init_saw_area = 0;
};

class Online {
 public:
  explicit Online(const std::string& scheduler = "CmpSchedule",
                  const std::string& file = application("online_1"),
                  const std::vector<std::string>& more = {})
      : process_(sandbox_, arguments(scheduler, file, more)) {
    if (more.empty()) process_.wait_until_up();
  }

  InstanceProcess& process() { return process_; }
  const Sandbox& sandbox() { return sandbox_; }

  ControlReply change(const std::string& file) { return process_.ask(ControlVerb::change_application, file); }
  VersionReport report() {
    const std::string key = "application: version ";
    const std::size_t before = process_.log().size();
    EXPECT_EQ(process_.event("report").post(), PostResult::posted);
    std::string fresh;
    const bool seen = eventually([&] {
      fresh = process_.log().substr(before);
      const std::size_t at = fresh.find(key);
      return at != std::string::npos && fresh.find('\n', at) != std::string::npos;
    });
    EXPECT_TRUE(seen) << process_.log();
    VersionReport report;
    if (!seen) return report;
    EXPECT_EQ(std::sscanf(fresh.c_str() + fresh.find(key),
                          "application: version %d counter %lu area %lu kept %lu fresh %lu works %lu own "
                          "figures %d init saw area %d",
                          &report.version, &report.counter, &report.area, &report.kept, &report.fresh,
                          &report.works, &report.own_figures, &report.init_saw_area),
              8);
    return report;
  }
  /// How often the program has said so.
  std::size_t count(const std::string& text) {
    const std::string log = process_.log();
    std::size_t count = 0;
    for (std::size_t at = log.find(text); at != std::string::npos; at = log.find(text, at + 1)) ++count;
    return count;
  }
  TaskCounters main() { return process_.task("Main")->counters; }
  bool runs(std::uint64_t more = 20) {
    const auto before = main().cycles;
    return eventually([&] { return main().cycles > before + more; });
  }
  std::string path() { return std::string(process_.runtime().application.view()); }
  /// Parts of copies in memory that are mapped, and descriptors that are open.
  std::pair<std::size_t, std::size_t> held() const {
    const std::string of_process = fmt::format("/proc/{}/", process_.pid());
    std::size_t mapped = 0;
    std::ifstream maps(of_process + "maps");
    for (std::string line; std::getline(maps, line);) mapped += line.contains("memfd:online") ? 1U : 0U;
    const auto files = std::filesystem::directory_iterator(of_process + "fd");
    return {mapped, static_cast<std::size_t>(std::distance(begin(files), end(files)))};
  }

 private:
  [[nodiscard]] std::vector<std::string> arguments(const std::string& scheduler, const std::string& file,
                                                   const std::vector<std::string>& more) const {
    std::vector<std::string> all{
        "--core",        std::to_string(allowed_cores(0).value().back()),
        "--scheduler",   scheduler,
        "--application", file,
        "--settings",    sandbox_.write("line1.cfg", "[CmpSchedule]\nWatchdog.DefaultTimeMs=0\n")};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  Sandbox sandbox_;
  InstanceProcess process_;
};

class OnlineChange : public ::testing::TestWithParam<std::string> {};

TEST_P(OnlineChange, GoesOnWithTheVariablesAndTheNewCodeWithoutALostCycle) {
  Online sut(GetParam());
  ASSERT_TRUE(sut.runs());
  const VersionReport before = sut.report();
  EXPECT_EQ(before.version, 1);
  const TaskCounters counters = sut.main();
  const auto pid = sut.process().pid();

  const auto changed = sut.change(application("online_2"));

  ASSERT_EQ(changed.code, ErrorCode::ok) << changed.text << sut.process().log();
  EXPECT_THAT(changed.text, AllOf(HasSubstr("taken over between two cycles"), HasSubstr("2 areas go on"),
                                  HasSubstr("variables machine were carried over (16 bytes)")));
  const VersionReport after = sut.report();
  EXPECT_EQ(after.version, 2);
  EXPECT_GE(after.counter, before.counter);
  ASSERT_TRUE(sut.runs());
  const VersionReport later = sut.report();
  for (const auto value : {&VersionReport::counter, &VersionReport::area, &VersionReport::kept}) {
    // By ones until the change, by thousands from then on: nothing in between was lost or counted twice.
    EXPECT_GT(later.*value, after.*value);
    EXPECT_EQ((later.*value - after.*value) % 1000, 0U);
  }
  const auto by_ones = later.counter - later.fresh * 1000;
  EXPECT_GE(by_ones, before.counter);
  EXPECT_EQ(later.area, later.counter + 7) << "the area began with 7";
  EXPECT_EQ(later.kept, later.counter);
  EXPECT_LE(by_ones + later.fresh, sut.main().cycles) << "each cycle ran one of the two versions";
  EXPECT_EQ(later.own_figures, 1) << "the program's own figures go on";
  EXPECT_EQ(later.init_saw_area, 0);
  EXPECT_EQ(sut.main().since_ns, counters.since_ns) << "the figures go on";
  EXPECT_GT(sut.main().cycles, counters.cycles);
  EXPECT_EQ(sut.process().pid(), pid);
  EXPECT_EQ(sut.path(), application("online_2"));
  const std::string log = sut.process().log();
  EXPECT_THAT(log, AllOf(HasSubstr("init of version 2, online 1"), HasSubstr("exit of version 1, online 1"),
                         HasSubstr("application running -> running: online change to")));
  EXPECT_EQ(sut.process().end(SIGTERM), EXIT_SUCCESS) << sut.process().log();
  EXPECT_THAT(sut.process().log(), HasSubstr("exit of version 2, online 0"));
}

INSTANTIATE_TEST_SUITE_P(Each, OnlineChange,
                         ::testing::Values("CmpSchedule", "CmpScheduleTimer", "CmpScheduleOneShot"),
                         [](const auto& tested) { return tested.param; });

TEST(OnlineChangeOfAnInstance, FindsTheTasksByNameAlsoInAnotherOrder) {
  Online sut;
  const auto changed = sut.change(application("online_reordered"));
  ASSERT_EQ(changed.code, ErrorCode::ok) << changed.text;
  ASSERT_TRUE(sut.runs());
  EXPECT_EQ(sut.report().version, 2);
  EXPECT_TRUE(eventually([&] { return sut.process().task("Report")->counters.cycles > 0; }));
}

struct Refusal {
  const char* file;
  const char* reason;
};

class RefusedOnlineChange : public ::testing::TestWithParam<Refusal> {};

TEST_P(RefusedOnlineChange, TellsTheReasonAndChangesNothing) {
  Online sut;
  ASSERT_TRUE(sut.runs());
  const std::string path = sut.path();
  const auto refused = sut.change(application(GetParam().file));
  EXPECT_NE(refused.code, ErrorCode::ok);
  EXPECT_THAT(refused.text, AllOf(HasSubstr(GetParam().reason), HasSubstr(GetParam().file)));
  const VersionReport before = sut.report();
  ASSERT_TRUE(sut.runs());
  const VersionReport after = sut.report();
  EXPECT_EQ(after.version, 1);
  EXPECT_GT(after.counter, before.counter);
  EXPECT_EQ(after.counter, after.fresh) << "nobody else has counted";
  EXPECT_EQ(sut.path(), path);
  EXPECT_EQ(sut.held().first, 0U) << "nothing of it is left";
  EXPECT_EQ(sut.count("init of version 1, online 1"), sut.count("exit of version 1, online 1"));
  const auto changed = sut.change(application("online_2"));
  EXPECT_EQ(changed.code, ErrorCode::ok) << changed.text;
  EXPECT_EQ(sut.report().version, 2);
}

std::string name_of_file(const ::testing::TestParamInfo<Refusal>& tested) {
  return tested.param.file;
}

INSTANTIATE_TEST_SUITE_P(
    Each, RefusedOnlineChange,
    ::testing::Values(
        Refusal{"online_other_name", "it is the application 'Other', 'Online' runs"},
        Refusal{"online_options", "no task 'Nobody'"},
        Refusal{"online_interval",
                "task 'Main': its interval is 3000 us, of the one that runs it is 2000 us"},
        Refusal{"online_priority", "task 'Main': its priority is 4, of the one that runs it is 5"},
        Refusal{"online_watchdog", "task 'Main': its watchdog's time is 1000000 us"},
        Refusal{"online_event", "task 'Work': its external event is work2, of the one that runs it is work"},
        Refusal{"online_task", "task 'Another' is new"}, Refusal{"online_no_task", "task 'Loop' is gone"},
        Refusal{"online_area", "area 'another' is new"},
        Refusal{"online_area_layout", "area 'kept': qwLayout is 2, of the one that runs it is 1"},
        Refusal{"online_area_flags", "area 'plain': dwFlags is 0x1, of the one that runs it is 0x10"},
        Refusal{"online_variables", "variables 'machine': dwBytes is 24, of the one that runs it is 16"},
        Refusal{"online_layout", "variables 'machine': qwLayout is 2, of the one that runs it is 1"},
        Refusal{"online_slow", "its set-up took "}, Refusal{"online_init_throws", "plc_app_init returned 1"},
        Refusal{"fault_no_tasks", "it has no tasks"}, Refusal{"fault_wrong_version", "version"},
        Refusal{"fault_missing_init", "does not export plc_app_init"},
        Refusal{"fault_undefined_symbol", "cannot be loaded"}, Refusal{"there_is_none", "cannot be opened"}),
    name_of_file);

#ifndef __clang__  // makes no such symbols
INSTANTIATE_TEST_SUITE_P(OfGnu, RefusedOnlineChange,
                         ::testing::Values(Refusal{"online_unique", "build it with -fno-gnu-unique"}),
                         name_of_file);
#endif

TEST(OnlineChangeOfAnInstance, AHundredTimesLeavesNothingBehindAndCountsEveryCycle) {
  Online sut;
  ASSERT_TRUE(sut.runs());
  ASSERT_EQ(sut.change(application("online_2")).code, ErrorCode::ok);
  std::this_thread::sleep_for(50ms);  // or the process still holds what the first change needed
  const auto held = sut.held();
  const auto lost = sut.main().lost_cycles;
  double longest = 0;
  for (int i = 0; i < 100; ++i) {
    const auto changed = sut.change(application(i % 2 == 0 ? "online_1" : "online_2"));
    ASSERT_EQ(changed.code, ErrorCode::ok) << changed.text;
    double held_us = 0;
    ASSERT_EQ(std::sscanf(changed.text.c_str(), "taken over between two cycles, within %lf us", &held_us), 1);
    longest = std::max(longest, held_us);
  }
  EXPECT_TRUE(eventually([&] {
    const auto now = sut.held();
    return now.first <= held.first && now.second <= held.second;
  })) << "but the connections of this test";
  ASSERT_TRUE(sut.runs());
  const VersionReport report = sut.report();
  EXPECT_EQ(report.version, 2);
  EXPECT_EQ(report.area, report.counter + 7);
  EXPECT_EQ(report.kept, report.counter);
  std::printf("100 online changes; the longest held all tasks for %.0f us; %llu cycles of %llu were lost\n",
              longest, static_cast<unsigned long long>(sut.main().lost_cycles - lost),
              static_cast<unsigned long long>(sut.main().cycles));
  EXPECT_EQ(sut.process().end(SIGTERM), EXIT_SUCCESS) << sut.process().log();
}

TEST(OnlineChangeOfAnInstance, TakesTheFileAsItIsNowUnderTheSamePath) {
  Sandbox files;
  const std::string path = files.folder() + "/online.so";
  std::filesystem::copy_file(application("online_1"), path);
  Online sut("CmpSchedule", path);
  std::filesystem::remove(path);
  std::filesystem::copy_file(application("online_2"), path);
  const auto changed = sut.change(path);
  ASSERT_EQ(changed.code, ErrorCode::ok) << changed.text;
  EXPECT_EQ(sut.report().version, 2);
}

TEST(OnlineChangeOfAnInstance, RunsEveryPostOnce) {
  Online sut;
  PoolEvent work = sut.process().event("work");
  unsigned long posts = 0;
  for (int i = 0; i < 10; ++i) {
    for (int j = 0; j < 100; ++j, ++posts) ASSERT_EQ(work.post(), PostResult::posted);
    ASSERT_EQ(sut.change(application(i % 2 == 0 ? "online_2" : "online_1")).code, ErrorCode::ok);
  }
  EXPECT_TRUE(eventually([&] { return sut.process().task("Work")->counters.cycles == posts; }));
  EXPECT_EQ(sut.report().works, posts);
  EXPECT_EQ(sut.process().task("Work")->counters.lost_events, 0U);
}

TEST(OnlineChangeOfAnInstance, WaitsForTheEndOfALongCycle) {
  Online sut;
  ASSERT_EQ(sut.process().event("hold").post(), PostResult::posted);
  ASSERT_TRUE(eventually([&] { return sut.process().task("Hold")->counters.cycles == 1; }));
  const auto changed = sut.change(application("online_2"));
  EXPECT_EQ(changed.code, ErrorCode::ok) << changed.text;
  EXPECT_EQ(sut.report().version, 2);
}

TEST(OnlineChangeOfAnInstance, ThatWaitsIsGivenUpForAStop) {
  Online sut;
  PacketSocket changer = sut.process().connect();
  ASSERT_EQ(sut.process().event("hold").post(), PostResult::posted);
  ASSERT_TRUE(eventually([&] { return sut.process().task("Hold")->counters.cycles == 1; }));
  // Main is within its cycle for 3 s.
  ASSERT_TRUE(eventually([&] {
    const auto before = sut.main().cycles;
    std::this_thread::sleep_for(100ms);
    return sut.main().cycles == before;
  }));
  ASSERT_TRUE(changer.send(
      encode(ControlRequest{5, ControlVerb::change_application, "line1", application("online_2")})));
  ASSERT_TRUE(eventually([&] { return sut.process().log().contains("init of version 2"); }));
  EXPECT_EQ(sut.process().ask(ControlVerb::stop).code, ErrorCode::ok);
  const auto packet = receive_until(changer, MonotonicClock::now() + 20s);
  ASSERT_TRUE(packet);
  const auto refused = decode_reply(*packet).value();
  EXPECT_EQ(refused.code, ErrorCode::refused);
  EXPECT_THAT(refused.text, AllOf(HasSubstr("has not taken over"), HasSubstr("'stop' came first")));
  EXPECT_EQ(sut.path(), application("online_1"));
  EXPECT_EQ(sut.held().first, 0U);
}

TEST(OnlineChangeOfAnInstance, IsDoneWhileItIsStoppedToo) {
  Online sut;
  ASSERT_TRUE(sut.runs());
  ASSERT_EQ(sut.process().ask(ControlVerb::stop).code, ErrorCode::ok);
  const auto cycles = sut.main().cycles;
  ASSERT_EQ(sut.change(application("online_2")).code, ErrorCode::ok);
  EXPECT_EQ(sut.main().cycles, cycles);
  ASSERT_EQ(sut.process().ask(ControlVerb::start).code, ErrorCode::ok);
  ASSERT_TRUE(sut.runs());
  const VersionReport report = sut.report();
  EXPECT_EQ(report.version, 2);
  EXPECT_EQ(report.counter, cycles + report.fresh * 1000);
}

TEST(OnlineChangeOfAnInstance, AFaultOfTheNewCodeIsFoundInTheNewFile) {
  Online sut;
  ASSERT_EQ(sut.change(application("online_2")).code, ErrorCode::ok);
  ASSERT_EQ(sut.process().event("fault").post(), PostResult::posted);
  const std::string kept = exception_path(sut.sandbox().folder(), "line1");
  ASSERT_TRUE(eventually([&] {
    const auto history = read_exceptions(kept);
    return history && !history->entries.empty();
  }));
  (void)sut.process().ask(ControlVerb::status);  // by the thread that finds the names
  const ExceptionEntry entry = read_exceptions(kept)->entries.front();
  EXPECT_EQ(entry.task, "Fault");
  EXPECT_EQ(entry.application, application("online_2"));
  EXPECT_THAT(entry.symbol, AllOf(HasSubstr("fault_of_version"), HasSubstr(" in online_2.so")));
  ASSERT_TRUE(
      eventually([&] { return sut.process().ask(ControlVerb::start).code == ErrorCode::wrong_state; }));
  const auto refused = sut.change(application("online_1"));
  EXPECT_EQ(refused.code, ErrorCode::wrong_state);
  EXPECT_THAT(refused.text, HasSubstr("reset it first"));
}

// Registered by a callback, which runs outside of plc_app_init.
TEST(OnlineChangeOfAnInstance, EndsALateRegistrationThatTheNewVersionDoesNotMake) {
  Online sut("CmpSchedule", application("online_late"));
  const PoolEvent late = sut.process().event("late");
  EXPECT_EQ(late.post(), PostResult::no_task);
  auto changed = sut.change(application("online_late_2"));
  ASSERT_EQ(changed.code, ErrorCode::ok) << changed.text;
  EXPECT_EQ(late.post(), PostResult::no_task) << "the new version has registered it, too";
  changed = sut.change(application("online_2"));
  ASSERT_EQ(changed.code, ErrorCode::ok) << changed.text;
  EXPECT_EQ(late.post(), PostResult::not_registered);
}

TEST(OnlineChangeOfAnInstance, NeedsAnApplication) {
  Sandbox sandbox;
  InstanceProcess sut(sandbox, {});
  sut.wait_until_up(false);
  const auto refused = sut.ask(ControlVerb::change_application, application("online_1"));
  EXPECT_EQ(refused.code, ErrorCode::wrong_state);
  EXPECT_THAT(refused.text, HasSubstr("no application to change online"));
}

}  // namespace
}  // namespace plchost::testing
