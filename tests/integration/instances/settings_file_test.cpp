// The effect of a settings file on a plc-instance.
#include <csignal>
#include <cstdio>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/launch/launch_contract.hpp"
#include "shm/pages/instance_page.hpp"
#include "tests/integration/instances/instance_process.hpp"

namespace plchost::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class SettingsFile : public ::testing::Test {
 protected:
  std::vector<std::string> with(const std::string& settings, const std::string& program = "optioned") const {
    return {"--settings", sandbox.write("line1.cfg", settings), "--application", application(program)};
  }
  Sandbox sandbox;
};

/// How far the grid of `task` lies behind that of "Fast", whose offset is 0.
Duration offset(const InstanceProcess& sut, const std::string& task, Duration interval) {
  const auto moved = sut.task(task);
  const auto plain = sut.task("Fast");
  const std::int64_t apart = moved->counters.release_ns - plain->counters.release_ns;
  return Duration((apart % interval.count() + interval.count()) % interval.count());
}

bool both_have_run(const InstanceProcess& sut) {
  return sut.task("Moved")->counters.cycles > 0 && sut.task("Fast")->counters.cycles > 0;
}

TEST_F(SettingsFile, StartOffsetOfTheApplicationHoldsAndThatOfTheSettingsWins) {
  {
    InstanceProcess sut(sandbox, with(""));
    sut.wait_until_up();
    ASSERT_TRUE(eventually([&] { return both_have_run(sut); }));
    EXPECT_EQ(offset(sut, "Moved", 2ms), 1ms) << "3 ms, seen from a grid of 2 ms";
    EXPECT_EQ(sut.end(SIGTERM), 0);
  }
  InstanceProcess sut(sandbox, with("[Task.Moved]\nStartOffsetNs=250000\n"));
  sut.wait_until_up();
  ASSERT_TRUE(eventually([&] { return both_have_run(sut); }));
  EXPECT_EQ(offset(sut, "Moved", 2ms), 250us);
}

TEST_F(SettingsFile, ApplicationLearnsItsInstancesNameAndItsParameters) {
  {
    InstanceProcess sut(sandbox, with(""));
    sut.wait_until_up();
    EXPECT_THAT(sut.log(), HasSubstr("instance line1, speed not set, empty is not set"));
  }
  InstanceProcess sut(sandbox, with("[Application]\nParameter.speed=\"1200 rpm; fast\"\nParameter.empty=\n"));
  sut.wait_until_up();
  EXPECT_THAT(sut.log(), HasSubstr("instance line1, speed 1200 rpm; fast, empty is set"));
}

TEST_F(SettingsFile, HistogramsAreAsFineAsItSays) {
  InstanceProcess sut(sandbox, with("[CmpSchedule]\nStatistics.FineTasks=1\n"));
  sut.wait_until_up();
  const auto page = InstancePageReader::open(sandbox.pool(), "line1");
  ASSERT_TRUE(page) << page.error().describe();
  EXPECT_GT(page->task_count(), 1U);
  EXPECT_EQ(page->histogram_shape().digits(), HistogramShape::kCoarse);
}

// Each fifth cycle of 4 ms takes 6 ms: `next` loses a release each time, `asap` runs it 2 ms late.
TEST_F(SettingsFile, LatePolicyAsapRunsWhatNextLoses) {
  const auto counters_with = [&](const std::string& policy) {
    InstanceProcess sut(sandbox, with("[Task.Late]\nLatePolicy=" + policy + "\n"));
    sut.wait_until_up();
    EXPECT_TRUE(eventually([&] { return sut.task("Late")->counters.cycles > 200; }));
    return sut.task("Late")->counters;
  };
  const auto share_lost = [](const TaskCounters& counters) {
    return static_cast<double>(counters.lost_cycles) / static_cast<double>(counters.cycles);
  };
  const TaskCounters next = counters_with("Next");
  TaskCounters asap = counters_with("Asap");
  // A core that stands still loses cycles under each policy.
  for (int more = 0; more < 4 && share_lost(asap) >= share_lost(next); ++more) asap = counters_with("Asap");
  EXPECT_GT(share_lost(next), 0.19);
  EXPECT_LT(share_lost(asap), share_lost(next));
  EXPECT_GT(asap.latency_max_ns, 1'900'000);
  EXPECT_GT(next.last_loss.end_ns, next.last_loss.release_ns + Duration(4ms).count())
      << "the cycle was too long";
}

TEST_F(SettingsFile, SectionOfATaskThatThereIsNotListsTheTasks) {
  InstanceProcess sut(sandbox, with("[CmpSchedule]\n[Task.Slow]\nLatePolicy=Asap\n"));
  EXPECT_EQ(sut.end(), 3);
  EXPECT_THAT(sut.log(),
              HasSubstr("line1.cfg:2: [Task.Slow]: the application has no task 'Slow'; its tasks are Fast, "
                        "Moved, Late, Report"));
}

TEST_F(SettingsFile, OffsetBeyondTheIntervalAndAsapOfAnEventTaskAreRefused) {
  InstanceProcess offset(sandbox, with("[Task.Fast]\nStartOffsetNs=2000000\n"));
  EXPECT_EQ(offset.end(), 3);
  EXPECT_THAT(offset.log(), HasSubstr("below its interval of 2000000 ns"));
  InstanceProcess asap(sandbox, with("[Task.Report]\nLatePolicy=Asap\n"));
  EXPECT_EQ(asap.end(), 3);
  EXPECT_THAT(asap.log(), HasSubstr("only a cyclic task can have a late policy"));
}

TEST_F(SettingsFile, TimerModeOneShotChoosesTheSchedulerUnlessOneIsNamed) {
  const auto scheduler_of = [&](std::vector<std::string> arguments) {
    InstanceProcess sut(sandbox, arguments);
    sut.wait_until_up();
    const auto report = decode_instance_report(sut.ask(ControlVerb::status).text);
    return std::pair(report ? report->scheduler : "", sut.log());
  };
  EXPECT_EQ(scheduler_of(with("")).first, "CmpSchedule");
  EXPECT_EQ(scheduler_of(with("[SysTimer]\nVxWorks.TimerMode=Periodic\n")).first, "CmpSchedule");
  EXPECT_EQ(scheduler_of(with("[SysTimer]\nVxWorks.TimerMode=OneShot\n")).first, "CmpScheduleOneShot");
  auto named = with("[SysTimer]\nVxWorks.TimerMode=OneShot\n");
  named.insert(named.end(), {"--scheduler", "CmpScheduleTimer"});
  const auto [scheduler, log] = scheduler_of(named);
  EXPECT_EQ(scheduler, "CmpScheduleTimer");
  EXPECT_THAT(log,
              HasSubstr("TimerMode=OneShot asks for CmpScheduleOneShot, but CmpScheduleTimer was asked for"));
}

TEST_F(SettingsFile, CustomSystemTimeIsWhatTheApplicationSees) {
  InstanceProcess sut(sandbox, with("[SysTime]\nVxWorks.CustomSysTimeGetUs=MySysTimeGetUs\n"
                                    "VxWorks.CustomSysTimeGetNs=MySysTimeGetNs\n"
                                    "VxWorks.CustomSysTimeLibrary=" +
                                    application("clocks") + "\n"));
  sut.wait_until_up();
  (void)sut.event("report").post();
  std::string line;
  ASSERT_TRUE(eventually([&] { return !(line = sut.last_line_from("time us ")).empty(); })) << sut.log();
  unsigned long us = 0;
  unsigned long ns = 0;
  unsigned int ms = 0;
  ASSERT_EQ(std::sscanf(line.c_str(), "time us %lu ns %lu ms %u", &us, &ns, &ms), 3);
  EXPECT_GT(us, 1'000'000'000'000UL) << "1,000,000 s ahead of CLOCK_MONOTONIC";
  EXPECT_NEAR(static_cast<double>(us), static_cast<double>(ns) / 1e3, 1e6);
  EXPECT_NEAR(static_cast<double>(ms), static_cast<double>(static_cast<unsigned int>(ns / 1'000'000)), 1e3);
}

TEST_F(SettingsFile, CustomSystemTimeThatIsNoClockIsRefusedByName) {
  const auto log_of = [&](const std::string& ns, const std::string& library) {
    InstanceProcess sut(
        sandbox, with("[SysTime]\nLinux.CustomSysTimeGetUs=MySysTimeGetUs\nLinux.CustomSysTimeGetNs=" + ns +
                      "\nLinux.CustomSysTimeLibrary=" + library + "\n"));
    EXPECT_EQ(sut.end(), 3);
    return sut.log();
  };
  EXPECT_THAT(log_of("OtherBaseNs", application("clocks")),
              AllOf(HasSubstr("MySysTimeGetUs of "), HasSubstr("have no common base")));
  EXPECT_THAT(log_of("DataNs", application("clocks")), HasSubstr("'DataNs' is no function"));
  EXPECT_THAT(log_of("StoppedNs", application("clocks")), HasSubstr("StoppedNs"));
  EXPECT_THAT(log_of("NoSuchNs", application("clocks")), HasSubstr("has no function 'NoSuchNs'"));
  EXPECT_THAT(log_of("MySysTimeGetNs", "clocks.so"), HasSubstr(sandbox.folder() + "/clocks.so"));
}

// The two lines as the seed has them.
constexpr const char* kSeedClock =
    "[SysTime]\nVxWorks.CustomSysTimeGetUs=MySysTimeGetUs\nVxWorks.CustomSysTimeGetNs=MySysTimeGetNs\n";

TEST_F(SettingsFile, CustomSystemTimeIsFoundInAComponentAndInWhatIsLoaded) {
  InstanceProcess component(
      sandbox, with(kSeedClock + ("[ComponentManager]\nComponent.1=" + application("clocks")) + "\n"));
  component.wait_until_up();
  EXPECT_THAT(component.log(), HasSubstr("first call of MySysTimeGetUs of " + application("clocks")));
  EXPECT_EQ(component.end(SIGTERM), 0);
  InstanceProcess loaded(sandbox, with(kSeedClock), {"LD_PRELOAD=" + application("clocks")});
  loaded.wait_until_up();
  EXPECT_THAT(loaded.log(), HasSubstr("first call of MySysTimeGetNs of " + application("clocks")));
}

TEST_F(SettingsFile, CustomSystemTimeThatIsNotLoadedNamesTheKeyOfItsLibrary) {
  InstanceProcess sut(sandbox, with(kSeedClock));
  EXPECT_EQ(sut.end(), 3);
  EXPECT_THAT(sut.log(), HasSubstr("has a function 'MySysTimeGetUs'; the key CustomSysTimeLibrary names"));
}

TEST_F(SettingsFile, CrashInACustomSystemTimeIsTheLastThingTheLogSpeaksOf) {
  InstanceProcess sut(sandbox, with("[SysTime]\nLinux.CustomSysTimeGetUs=MySysTimeGetUs\n"
                                    "Linux.CustomSysTimeGetNs=CrashNs\nLinux.CustomSysTimeLibrary=" +
                                    application("clocks") + "\n"));
  EXPECT_EQ(sut.end(), -SIGABRT);
  EXPECT_THAT(sut.log(), HasSubstr("first call of CrashNs of " + application("clocks")));
}

// As such files are written for another runtime: all of it is accepted, and what is left alone is said.
constexpr const char* kForeignFile = R"(;linux
[SysFile]
FilePath.1=/etc/, 3S.dat
PlcLogicPrefix=1

[CmpLog]
Logger.0.Name=/tmp/codesyscontrol.log
Logger.0.Filter=0x0000000F
Logger.0.Backend.0.ClassId=0x00000104 ;writes logger messages in a file
Logger.0.Type=0x314 ;Set the timestamp to RTC

[ComponentManager]
Component.1=CmpBACnet
Component.2=CmpBACnet2
Component.3=CmpPLCHandler
Component.4=CmpGwClient
Component.5=CmpXMLParser
;Component.7=CmpGwClientCommDrvShm ; enable only if necessary, can result in higher cpu load
;Component.8=SysPci				; enable when using Hilscher CIFX

[CmpApp]
Bootproject.RetainMismatch.Init=1
Application.1=Application

[CmpRedundancyConnectionIP]

[SysExcept]
Linux.DisableFpuUnderflowException=1

[SysCpuHandling]
Linux.DisableCpuDmaLatency=1

[SysTask]
OSPriority.Realtime.Base=45

[SysEthernet]
Linux.ProtocolFilter=3

[CmpSchedule]
EnableLogger=1
SchedulerInterval=4000
ProcessorLoad.Enable=0
ProcessorLoad.Maximum=95
ProcessorLoad.Interval=5000
DisableOmittedCycleWatchdog=1
Task.Freewheeling.Cycletime=10
Scheduling.TaskSupervisor=WatchdogTimer
Timeslicing.Mode=None

[SysTimer]
VxWorks.TimerSource=Task
VxWorks.TimerMode=OneShot

[SysMem]
Linux.Memlock=1
VxWorks.Area.0.Flags=0x8000
VxWorks.Area.0.Address=0x60540010
VxWorks.Area.0.Size=0x10000

[CmpSecureChannel]
SECURITY.CommunicationMode=ONLY_PLAIN
[CmpUserMgr]
AsymmetricAuthKey=0a41d6cf5363d976dce29a300697919b8ece69bd
[CmpSecureChannel]
CertificateHash=3c0f5865dd0f0fa209668e8f68c2d1341f37a805
)";

TEST_F(SettingsFile, FileOfAnotherRuntimeIsUsedAsItIs) {
  InstanceProcess sut(sandbox, with(kForeignFile));
  sut.wait_until_up();
  const auto report = decode_instance_report(sut.ask(ControlVerb::status).text);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->scheduler, "CmpScheduleOneShot");
  const std::string log = sut.log();
  EXPECT_THAT(
      log,
      HasSubstr("sections of other programs, left alone: SysFile, CmpLog, CmpApp, CmpRedundancyConnectionIP, "
                "SysExcept, SysCpuHandling, SysTask, SysEthernet, CmpSecureChannel, CmpUserMgr\n"));
  EXPECT_THAT(log,
              HasSubstr("components of other programs, left alone: CmpBACnet, CmpBACnet2, CmpPLCHandler, "
                        "CmpGwClient, CmpXMLParser\n"));
  for (const char* const key : {"EnableLogger", "Scheduling.TaskSupervisor", "Timeslicing.Mode"}) {
    EXPECT_THAT(log, HasSubstr(std::string("[CmpSchedule] ") + key + " has no meaning here and is ignored"));
  }
  EXPECT_EQ(sut.end(SIGTERM), 0);
}

TEST(SettingsCheck, SaysWhatIsWrongOrThatAllIsWell) {
  const Sandbox sandbox;
  const std::string good = sandbox.write("good.cfg", "[CmpSchedule]\nSchedulerInterval=1000\n");
  InstanceProcess sut(sandbox, {"--check-settings", good});
  EXPECT_EQ(sut.end(), 0);
  EXPECT_EQ(sut.log(), good + ": ok\n");
  const std::string bad = sandbox.write("bad.cfg", "[SysTimer]\nTimerMode=OneShot\n");
  InstanceProcess refused(sandbox, {"--check-settings", bad});
  EXPECT_EQ(refused.end(), 3);
  EXPECT_THAT(refused.log(), ::testing::StartsWith(bad + ":2: [SysTimer] has no key 'TimerMode'"));
  EXPECT_THAT(refused.log(), ::testing::HasSubstr("did you mean 'Linux.TimerMode'?"));
}

}  // namespace
}  // namespace plchost::testing
