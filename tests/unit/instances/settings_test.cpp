#include <cstdlib>
#include <fstream>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "instances/runtime/settings/read_settings.hpp"
#include "instances/runtime/settings/settings_key.hpp"
#include "instances/runtime/tasks/task_builder.hpp"
#include "shm/block_driver/node_directory.hpp"

namespace plchost {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string complaint(std::string_view text) {
  const auto settings = parse_settings(text, "line1.cfg");
  return settings ? std::string() : settings.error().message;
}

TEST(Settings, DefaultsHoldWhereTheFileIsSilent) {
  const auto sut = parse_settings("", "line1.cfg");
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->scheduler.scheduler_interval, 1ms);
  EXPECT_THAT(sut->components, IsEmpty());
}

TEST(Settings, ReadsEveryKey) {
  const auto sut = parse_settings(
      "; comment\r\n"
      "[CmpSchedule]\r\n"
      "SchedulerInterval=100000\r\n"
      "  Task.Freewheeling.Cycletime = 10  ; ms\n"
      "ProcessorLoad.Maximum=60\n"
      "SpinAhead.MaxUs=0\n"
      "ExternalEvent.MaxBacklog=500\n"
      "Statistics.FineTasks=1024\n"
      "[SysTimer]\n"
      "VxWorks.TimerSource=Task\n"
      "[ComponentManager]\n"
      "Component.10=later.so\n"
      "Component.2=/first.so\n",
      "line1.cfg");
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->scheduler.scheduler_interval, 100ms);
  EXPECT_EQ(sut->scheduler.freewheeling_cycletime, 10ms);
  EXPECT_EQ(sut->scheduler.processor_load_maximum, 60);
  EXPECT_EQ(sut->scheduler.spin_ahead_max, 0us);
  EXPECT_EQ(sut->scheduler.max_event_backlog, 500U);
  EXPECT_EQ(sut->fine_tasks, 1024U);
  EXPECT_EQ(sut->scheduler.tick_source, TickSourceKind::task);
  EXPECT_THAT(sut->components, ElementsAre("/first.so", "later.so"));
}

TEST(Settings, ReadsTheDistributedClock) {
  const auto sut = parse_settings(
      "[DistributedClock]\nReference=bus1\nKpPpm=10000\nKiPpm=25\nMaxCorrectionNs=500\nSyncWindowNs=200000\n"
      "PairToleranceNs=3000\nReferenceTimeoutMs=50\nHoldOverMs=0\n",
      "line1.cfg");
  ASSERT_TRUE(sut) << sut.error().message;
  const DistributedClockSettings expected{.reference = "bus1",
                                          .kp_ppm = 10'000,
                                          .ki_ppm = 25,
                                          .max_correction = 500ns,
                                          .sync_window = 200us,
                                          .pair_tolerance = 3us,
                                          .reference_timeout = 50ms,
                                          .hold_over_limit = 0ms};
  EXPECT_EQ(sut->scheduler.distributed_clock, expected);
  EXPECT_THAT(complaint("[DistributedClock]\nReference=a/b\n"),
              AllOf(HasSubstr("line1.cfg:2: [DistributedClock] Reference"),
                    HasSubstr("realtime, tai, ptp:/dev/NAME, or the name of a shared memory")));
  EXPECT_THAT(complaint("[DistributedClock]\nKpPpm=0\n"), HasSubstr("1 to 1000000"));
  EXPECT_THAT(complaint("[DistributedClock]\nSyncWindow=1\n"), HasSubstr("did you mean 'SyncWindowNs'?"));
}

TEST(Settings, DefaultsOfTheDistributedClockAreThoseOfItsTable) {
  const DistributedClockSettings initial;
  std::string text = "[DistributedClock]\n";
  for (const SettingKey& key : clock_keys()) {
    const std::string written = initial_value(key);
    if (!written.empty()) text += fmt::format("{}={}\n", key.name, written);
  }
  const auto sut = parse_settings(text, "line1.cfg");
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->scheduler.distributed_clock, initial);
}

TEST(Settings, WritesFrequenciesOfAnRtcWithDecimals) {
  const auto interval = [](const std::string& text) {
    return parse_settings("[CmpSchedule]\nSchedulerInterval=" + text + "\n", "line1.cfg")
        .value()
        .scheduler.scheduler_interval;
  };
  EXPECT_EQ(interval("976.5625"), std::chrono::nanoseconds(976'563));
  EXPECT_EQ(interval("1953.125"), std::chrono::nanoseconds(1'953'125));
  EXPECT_EQ(interval("50.1"), std::chrono::nanoseconds(50'100));
}

TEST(Settings, TakesLinuxAsAnotherWordForVxWorks) {
  const auto sut = parse_settings("[SysTimer]\nLinux.TimerSource=Task\n", "line1.cfg");
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->scheduler.tick_source, TickSourceKind::task);
}

TEST(Settings, TakesTheLastOfAKeyAndSaysWhichItReplaces) {
  const auto sut = parse_settings(
      "[SysTimer]\nLinux.TimerSource=Task\nVxWorks.TimerSource=System\n[Task.Fast]\nDrivesOutputs=1\n[CmpLog]"
      "\n"
      "[Task.Fast]\nDrivesOutputs=0\n[ComponentManager]\nComponent.1=CmpA\nComponent.01=b.so\nComponent.2=c."
      "so\n"
      "Component.2=CmpC\n",
      "f");
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->scheduler.tick_source, TickSourceKind::system);
  EXPECT_EQ(sut->tasks.at(0).drives_outputs, false);
  EXPECT_THAT(sut->components, ElementsAre("b.so"));
  EXPECT_THAT(sut->foreign_components, ElementsAre("CmpC"));
  EXPECT_THAT(sut->remarks,
              ElementsAre("f:3: [SysTimer] VxWorks.TimerSource takes the place of the one in f:2",
                          "f:8: [Task.Fast] DrivesOutputs takes the place of the one in f:5",
                          "f:11: [ComponentManager] Component.01 takes the place of the one in f:10",
                          "f:13: [ComponentManager] Component.2 takes the place of the one in f:12"));
}

// Each is found in files that the other runtime takes.
TEST(Settings, TakesValuesAsTheOtherRuntimesFilesHaveThem) {
  const auto interval = [](const std::string& value) {
    const auto sut = parse_settings("[CmpSchedule]\nSchedulerInterval=" + value + "\n", "f");
    return sut ? sut->scheduler.scheduler_interval : Duration(-1);
  };
  EXPECT_EQ(interval("0x3E8"), 1ms);
  EXPECT_EQ(interval("0X3e8 ; us"), 1ms);
  EXPECT_EQ(interval("16#3E8"), 1ms);
  EXPECT_EQ(interval("16#03_e8 # us"), 1ms);
  EXPECT_EQ(interval("8#1750"), 1ms);
  EXPECT_EQ(interval("2#11_1110_1000"), 1ms);
  for (const char* const wrong :
       {"16#", "16#-1", "2#2", "10#200", "16#_3E8", "16#3E8_", "16#3__E8", "0x3_E8"}) {
    EXPECT_EQ(interval(wrong), -1ns) << wrong;
  }
  EXPECT_EQ(interval("200; us"), 200us);
  EXPECT_EQ(interval("200;"), 200us);
  EXPECT_EQ(interval("200 # us"), 200us);
  EXPECT_EQ(interval("\"200\" ; us"), 200us);
  const auto sut = parse_settings(
      "[SysTimer]\nVxWorks.TimerMode=\"oneshot\"\nVxWorks.TimerSource=TASK\n"
      "VxWorks.AuxiliaryDevice=/dev/rtc0;1#2 # the clock\n[ComponentManager]\nComponent.1=\"a ; b.so\" # x\n",
      "f");
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->timer_mode, TimerMode::one_shot);
  EXPECT_EQ(sut->scheduler.tick_source, TickSourceKind::task);
  EXPECT_EQ(sut->scheduler.auxiliary_device, "/dev/rtc0;1#2");
  EXPECT_THAT(sut->components, ElementsAre("a ; b.so"));
}

TEST(Settings, TakesTheOtherRuntimesWaysToSayDefault) {
  const auto sut = parse_settings(
      "[CmpSchedule]\nTask.Freewheeling.Cycletime=0\n[SysTime]\nVxWorks.CustomSysTimeGetUs=\n"
      "VxWorks.CustomSysTimeGetNs=\nVxWorks.CustomSysTimeLibrary=\n",
      "f");
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(*sut, InstanceSettings{});
}

TEST(Settings, ALoadAboveAHundredPercentActsAsAHundred) {
  const auto sut = parse_settings("[CmpSchedule]\nProcessorLoad.Maximum=200\n", "f");
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->scheduler.processor_load_maximum, 100);
  EXPECT_THAT(sut->remarks, ElementsAre("f:2: [CmpSchedule] ProcessorLoad.Maximum: 200 acts as 100"));
}

TEST(Settings, AMaximumOfTheLoadArmsItsWatchdogUnlessThatIsOff) {
  const auto armed = [](const std::string& more) {
    return parse_settings("[CmpSchedule]\nProcessorLoad.Maximum=10\n" + more, "f")->scheduler.watchdog.load;
  };
  EXPECT_TRUE(armed(""));
  EXPECT_FALSE(armed("ProcessorLoad.Enable=0\n"));
}

TEST(Settings, LeavesForeignSectionsAloneAndListsEachOnce) {
  const auto sut = parse_settings(
      "[CmpLog]\nA=1\nany words at all\n[CmpGateway]\nC=3\n[CmpLog]\nD=4\n[Tasks]\n[Task]\n", "line1.cfg");
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_THAT(sut->foreign_sections, ElementsAre("CmpLog", "CmpGateway", "Tasks", "Task"));
}

TEST(Settings, SuggestsTheKeyThatWasMeant) {
  const std::string text = complaint("[CmpSchedule]\n; x\nSchedulerIntervall=1000\n");
  EXPECT_THAT(text, HasSubstr("line1.cfg:3: [CmpSchedule] has no key 'SchedulerIntervall'"));
  EXPECT_THAT(text, HasSubstr("did you mean 'SchedulerInterval'?"));
  EXPECT_THAT(text, HasSubstr("allowed are SchedulerInterval, Task.Freewheeling.Cycletime"));
}

struct BadFile {
  const char* text;
  const char* complaint;
};

class BadSettings : public ::testing::TestWithParam<BadFile> {};

TEST_P(BadSettings, AreRefusedWithTheirLine) {
  EXPECT_THAT(complaint(GetParam().text), HasSubstr(GetParam().complaint));
}

INSTANTIATE_TEST_SUITE_P(
    Files, BadSettings,
    ::testing::Values(
        BadFile{"[CmpSchedule]\nSchedulerInterval=49\n",
                "line1.cfg:2: [CmpSchedule] SchedulerInterval: '49'"},
        BadFile{"[CmpSchedule]\nSchedulerInterval=1000001\n", "us, 50 to 1000000"},
        BadFile{"[CmpSchedule]\nSchedulerInterval=1ms\n", "'1ms' is not allowed"},
        BadFile{"[CmpSchedule]\nSchedulerInterval=976.56255\n", "'976.56255' is not allowed"},
        BadFile{"[CmpSchedule]\nSchedulerInterval=1000.\n", "'1000.' is not allowed"},
        BadFile{"[CmpSchedule]\nSchedulerInterval=1000.-5\n", "with up to four decimals"},
        BadFile{"[CmpSchedule]\nSchedulerInterval=\n", "'' is not allowed"},
        BadFile{"[CmpSchedule]\nSchedulerInterval=99999999999999999999\n", "is not allowed"},
        BadFile{"[CmpSchedule]\nTask.Freewheeling.Cycletime=-2\n", "ms, 1 to 60000, or 0 or -1 (not set)"},
        BadFile{"[CmpSchedule]\nProcessorLoad.Maximum=-1\n", "0 to 100, more acts as 100"},
        BadFile{"[CmpSchedule]\nProcessorLoad.Interval=0x\n", "'0x' is not allowed"},
        BadFile{"[CmpSchedule]\nProcessorLoad.Interval=0x-5\n", "'0x-5' is not allowed"},
        BadFile{"[CmpSchedule]\nSchedulerInterval=0x3E8.5\n", "'0x3E8.5' is not allowed"},
        BadFile{"[CmpSchedule]\nSchedulerInterval=\"1000\n", "'\"1000' is not allowed"},
        BadFile{"[CmpSchedule]\nSchedulerInterval=200;us\n", "'200;us' is not allowed"},
        BadFile{"[CmpSchedule]\nSpinAhead.MaxUs=-1\n", "0 to 1000"},
        BadFile{"[CmpSchedule]\nExternalEvent.MaxBacklog=0\n", "events, 1 to"},
        BadFile{"[SysTimer]\nVxWorks.TimerSource=Clock\n",
                "'Clock' is not allowed; allowed is: System, Task, Auxiliary"},
        BadFile{"[SysTimer]\nTimerMode=OneShot\n", "did you mean 'Linux.TimerMode'?"},
        BadFile{"[SysTimer]\nLinux.TimerMod=OneShot\n", "did you mean 'Linux.TimerMode'?"},
        BadFile{"[SysTimer]\nLinux.AuxiliaryDevice=rtc0\n", "absolute path of a character device"},
        BadFile{"[SysTime]\nLinux.CustomSysTimeGetUs=my time\n", "name of a C function"},
        BadFile{"[SysTime]\nLinux.CustomSysTimeGetUs=f\n", "needs both of CustomSysTimeGetUs and"},
        BadFile{"[SysTime]\nLinux.CustomSysTimeLibrary=f.so\n", "needs both of CustomSysTimeGetUs and"},
        BadFile{"[Task.]\n", "task '' is not valid"}, BadFile{"[Task.a b]\n", "task 'a b' is not valid"},
        BadFile{"[Task.Fast]\nLatePolicy=soon\n",
                "[Task.Fast] LatePolicy: 'soon' is not allowed; allowed is: Next, Asap"},
        BadFile{"[Task.Fast]\nStartOffset=1\n", "did you mean 'StartOffsetNs'?"},
        BadFile{"[Task.Fast]\nStartOffsetNs=-1\n", "0 to 4320000000000000"},
        BadFile{"[Task.Fast]\nWatchdog.Sensitivity=0\n", "cycles, 1 to 1000000"},
        BadFile{"[ComponentManager]\nComponent.x=a.so\n", "has no key 'Component.x'"},
        BadFile{"[ComponentManager]\nComponent.1000=a.so\n", "has no key 'Component.1000'"},
        BadFile{"[ComponentManager]\nComponent.1=\n", "allowed is: file of a shared object"},
        BadFile{"SchedulerInterval=1000\n",
                "line1.cfg:1: 'SchedulerInterval' stands before the first [Section]"},
        BadFile{"[CmpSchedule]\nwhat is this\n", "line1.cfg:2: neither [Section] nor Key=Value"},
        BadFile{"[CmpSchedule] SchedulerInterval=100\n",
                "line1.cfg:1: 'SchedulerInterval=100' stands behind [CmpSchedule]"},
        BadFile{"[Foo] a=1\n", "'a=1' stands behind [Foo]"},
        BadFile{"[Foo]\n[CmpSchedule] a=1\n", "line1.cfg:2: 'a=1' stands behind [CmpSchedule]"},
        BadFile{"[Foo]\n[CmpSchedule\n", "line1.cfg:2: neither"},
        BadFile{"[cmpschedule]\n", "there is no section [cmpschedule], did you mean [CmpSchedule]?"},
        BadFile{"[Foo]\n[ CmpShedule ]\n", "line1.cfg:2: there is no section [CmpShedule], did you mean"},
        BadFile{"[Systimer]\n", "did you mean [SysTimer]?"},
        BadFile{"[DistribuetdClocks]\n", "did you mean [DistributedClock]?"},
        BadFile{"[task.Fast]\n", "did you mean [Task.NAME]?"},
        BadFile{"; old\r[CmpSchedule]\rSchedulerInterval=junk\r", "line1.cfg:3: "},
        BadFile{"[CmpSchedule\n", "line1.cfg:1: neither"}, BadFile{"[ ]\n", "line1.cfg:1: neither"}));

TEST(Settings, TakesBlanksAndACommentAroundASection) {
  const auto sut = parse_settings("  [ CmpSchedule ] ; ours\nSchedulerInterval=2000\n[Foo]# theirs\n", "f");
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->scheduler.scheduler_interval, 2ms);
  EXPECT_THAT(sut->foreign_sections, ElementsAre("Foo"));
}

// As they stand in files of the other runtime.
TEST(Settings, TakesNoSectionOfAnotherProgramForAMisspeltOne) {
  for (const char* const name :
       {"SysFile",     "SysMem",        "SysTask",          "SysCom",       "SysTimeRtc",
        "SysTarget",   "SysProcess",    "SysSocket",        "SysExcept",    "SysCpuHandling",
        "SysEthernet", "CmpLog",        "CmpApp",           "CmpDevice",    "CmpSettings",
        "CmpUserMgr",  "CmpRedundancy", "CmpSecureChannel", "CmpWebServer", "CmpOPCUAServer",
        "Task"}) {
    EXPECT_EQ(complaint(fmt::format("[{}]\n", name)), "");
  }
}

TEST(Settings, LeavesABrokenLineOfAForeignSectionAloneWithARemark) {
  const auto sut = parse_settings("[Foo]\n[broken\nx\n[1] = 2\n[CmpSchedule]\nSchedulerInterval=2000\n", "f");
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->scheduler.scheduler_interval, 2ms);
  EXPECT_THAT(sut->foreign_sections, ElementsAre("Foo"));
  EXPECT_THAT(sut->remarks,
              ElementsAre(HasSubstr("f:2: '[broken' is no section"), HasSubstr("f:4: '[1] = 2'")));
}

TEST(Settings, RefusesZeroBytes) {
  EXPECT_THAT(complaint(std::string_view("[X]\nA=\0\n", 8)), HasSubstr("line1.cfg:2: holds a zero byte"));
}

TEST(Settings, TellsOfALongTextOnlyItsBeginning) {
  const std::string long_text(100'000, 'x');
  for (const std::string& text :
       {long_text + "=1\n", "[CmpSchedule]\n" + long_text + "=1\n", "[Task." + long_text + "]\n",
        "[CmpSchedule]\nSchedulerInterval=" + long_text, "[SysTimer]\nWinCE." + long_text + "=1\n",
        "[ComponentManager]\nComponent." + std::string(100'000, '0') + "=\n"}) {
    EXPECT_LT(complaint(text).size(), 1000U);
    EXPECT_GT(complaint(text).size(), 0U);
  }
}

// 100,000 sections take far less than a second; compared with each other they took half a minute.
TEST(Settings, ReadsAsManySectionsAsAFileCanHold) {
  constexpr int kSections = 60'000;
  std::string text;
  for (int i = 0; i < kSections; ++i) text += fmt::format("[s{:06}]\n", i);
  for (int i = 0; i < kSections / 2; ++i) text += fmt::format("[Task.t{:05}]\n", i);
  const auto sut = parse_settings(text, "line1.cfg");
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->foreign_sections.size(), static_cast<std::size_t>(kSections));
  EXPECT_EQ(sut->tasks.size(), static_cast<std::size_t>(kSections) / 2);
}

TEST(Settings, ReadsTheOptionsOfEachTask) {
  const auto sut = parse_settings(
      "[Task.Fast]\nLatePolicy=Asap\nStartOffsetNs=250000\nDrivesOutputs=1\nWatchdog.TimeUs=900\n"
      "Watchdog.Sensitivity=3\nWatchdog.OmittedCycles=4\nWatchdog.Policy=Task\n[Task.S.low]\n[Task.Fast]\n",
      "line1.cfg");
  ASSERT_TRUE(sut) << sut.error().message;
  ASSERT_EQ(sut->tasks.size(), 2U);
  const TaskSettings wanted{.task = "Fast",
                            .where = "line1.cfg:1: [Task.Fast]",
                            .late = LatePolicy::asap,
                            .start_offset = 250us,
                            .drives_outputs = true,
                            .watchdog_time = 900us,
                            .watchdog_sensitivity = 3,
                            .watchdog_omitted_cycles = 4,
                            .watchdog_policy = WatchdogPolicy::task};
  EXPECT_EQ(sut->tasks[0], wanted);
  EXPECT_EQ(sut->tasks[1], (TaskSettings{.task = "S.low", .where = "line1.cfg:9: [Task.S.low]"}));
}

TEST(Settings, ParametersOfTheApplicationHaveNamesOfTheirWriter) {
  const auto sut = parse_settings(
      "[Application]\nParameter.speed=1200 ; rpm\nParameter.a.b-c_1=\"x; "
      "y\"\nParameter.speed=1300\nParameter.none=\n",
      "line1.cfg");
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(sut->parameters, (Parameters{{"a.b-c_1", "x; y"}, {"none", ""}, {"speed", "1300"}}));
  EXPECT_THAT(sut->remarks,
              ElementsAre(HasSubstr("Parameter.speed takes the place of the one in line1.cfg:2")));
}

TEST(Settings, ParametersHaveBounds) {
  const auto error_of = [](const std::string& text) {
    const auto sut = parse_settings("[Application]\n" + text, "line1.cfg");
    return sut ? std::string() : sut.error().message;
  };
  EXPECT_THAT(error_of("Parameter.=1\n"), HasSubstr("[Application] has no key 'Parameter.'"));
  EXPECT_THAT(error_of("Parameter." + std::string(kMaxParameterName + 1, 'x') + "=1\n"), HasSubstr("no key"));
  EXPECT_EQ(error_of("Parameter.x=" + std::string(kMaxParameterText, 'x') + "\n"), "");
  EXPECT_THAT(error_of("Parameter.x=" + std::string(kMaxParameterText + 1, 'x') + "\n"),
              HasSubstr("a text of at most 500 bytes"));
  std::string all;
  for (std::size_t i = 0; i < kMaxParameters; ++i) all += fmt::format("Parameter.p{}=1\n", i);
  EXPECT_EQ(error_of(all + "Parameter.p0=2\n"), "");
  EXPECT_THAT(error_of(all + "Parameter.more=1\n"), HasSubstr("at most 256"));
}

TEST(Settings, DefaultsOfTheTableAreThoseOfTheProgram) {
  std::string file;
  for (const SettingKey& key : all_setting_keys()) {
    const std::string written = initial_value(key);
    if (written.empty() || key.section == kTaskSections) continue;
    file += fmt::format("[{}]\n{}={}\n", key.section, written_name(key), written);
  }
  const auto sut = parse_settings(file, "line1.cfg");
  ASSERT_TRUE(sut) << sut.error().message;
  EXPECT_EQ(*sut, InstanceSettings{});
  EXPECT_EQ(sut->blocks.base, kDefaultBlockBase);
}

TEST(Settings, DefaultsOfATaskAreThoseOfTheProgram) {
  std::string file = "[Task.T]\n";
  for (const SettingKey& key : all_setting_keys()) {
    if (key.section == kTaskSections) file += fmt::format("{}={}\n", key.name, initial_value(key));
  }
  const auto sut = parse_settings(file, "line1.cfg");
  ASSERT_TRUE(sut) << sut.error().message;
  std::vector<TaskConfig> tasks(1);
  tasks[0].name = "T";
  tasks[0].interval = 1ms;
  tasks[0].entry = [] {};
  ASSERT_TRUE(apply_task_settings(sut->tasks, tasks));
  EXPECT_EQ(tasks[0].late, TaskConfig{}.late);
  EXPECT_EQ(tasks[0].start_offset, TaskConfig{}.start_offset);
  EXPECT_EQ(tasks[0].watchdog, TaskWatchdog{});
  EXPECT_EQ(tasks[0].drives_outputs, TaskConfig{}.drives_outputs);
}

// PLCHOST_WRITE_TABLES=1 writes the table into the page.
TEST(Settings, PageHasTheTableOfTheKeys) {
  constexpr std::string_view kBegin = "<!-- generated: settings, by instances_unit_test -->\n";
  constexpr std::string_view kEnd = "<!-- end of generated -->";
  std::string table = "| section and key | unit, range | default | meaning |\n| --- | --- | --- | --- |\n";
  for (const SettingKey& key : all_setting_keys()) {
    if (std::holds_alternative<UnusedSetting>(key.value)) continue;
    EXPECT_FALSE(key.meaning.empty()) << key.section << " " << key.name;
    const std::string initial = initial_value(key);
    table += fmt::format("| `[{}] {}` | {} | {} | {} |\n", key.section, written_name(key),
                         allowed_values(key), initial.empty() ? "none" : initial, key.meaning);
  }
  std::stringstream stream;
  stream << std::ifstream(INSTANCES_SETTINGS).rdbuf();
  std::string page = stream.str();
  const std::size_t begin = page.find(kBegin);
  ASSERT_NE(begin, std::string::npos) << INSTANCES_SETTINGS " has no line " << kBegin;
  const std::size_t size = page.find(kEnd, begin) - begin - kBegin.size();
  ASSERT_LT(size, page.size()) << INSTANCES_SETTINGS " has no line " << kEnd;
  if (std::getenv("PLCHOST_WRITE_TABLES") != nullptr) {
    std::ofstream(INSTANCES_SETTINGS) << page.replace(begin + kBegin.size(), size, table);
    return;
  }
  EXPECT_EQ(page.substr(begin + kBegin.size(), size), table) << "write it: PLCHOST_WRITE_TABLES=1";
}

TEST(Settings, NamesAFileThatIsNotThereOrNoFile) {
  EXPECT_EQ(read_settings("/nonexistent.cfg").error().code, ErrorCode::not_found);
  EXPECT_EQ(read_settings("/").error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(read_settings("/proc/self/mem").error().code, ErrorCode::system);  // its first page is not mapped
}

}  // namespace
}  // namespace plchost
