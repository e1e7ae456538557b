#include "instances/runtime/settings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace plchost {
namespace {

using namespace std::chrono_literals;
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
  EXPECT_EQ(sut->scheduler.tick_source, TickSourceKind::task);
  EXPECT_THAT(sut->components, ElementsAre("/first.so", "later.so"));
}

TEST(Settings, TakesLinuxAsAnotherWordForVxWorks) {
  const auto sut = parse_settings("[SysTimer]\nLinux.TimerSource=Task\n", "line1.cfg");
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->scheduler.tick_source, TickSourceKind::task);
  EXPECT_THAT(complaint("[SysTimer]\nLinux.TimerSource=Task\nVxWorks.TimerSource=Task\n"),
              HasSubstr("line1.cfg:3: [SysTimer] VxWorks.TimerSource is given twice"));
}

TEST(Settings, LeavesForeignSectionsAloneAndListsEachOnce) {
  const auto sut = parse_settings("[SysTime]\nA=1\nB=2\n[CmpRouter]\nC=3\n[SysTime]\nD=4\n", "line1.cfg");
  ASSERT_TRUE(sut);
  EXPECT_THAT(sut->foreign_sections, ElementsAre("SysTime", "CmpRouter"));
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
        BadFile{"[CmpSchedule]\nSchedulerInterval=1000001\n", "an integer from 50 to 1000000"},
        BadFile{"[CmpSchedule]\nSchedulerInterval=1ms\n", "'1ms' is not allowed"},
        BadFile{"[CmpSchedule]\nSchedulerInterval=\n", "'' is not allowed"},
        BadFile{"[CmpSchedule]\nSchedulerInterval=99999999999999999999\n", "is not allowed"},
        BadFile{"[CmpSchedule]\nTask.Freewheeling.Cycletime=0\n", "from 1 to 60000"},
        BadFile{"[CmpSchedule]\nProcessorLoad.Maximum=100\n", "from 1 to 99"},
        BadFile{"[CmpSchedule]\nSpinAhead.MaxUs=-1\n", "from 0 to 1000"},
        BadFile{"[CmpSchedule]\nExternalEvent.MaxBacklog=0\n", "from 1 to"},
        BadFile{"[CmpSchedule]\nSchedulerInterval=100\n\nSchedulerInterval=100\n", "line1.cfg:4: "},
        BadFile{"[SysTimer]\nVxWorks.TimerSource=Auxiliary\n",
                "'Auxiliary' is not allowed: System and Task are"},
        BadFile{"[SysTimer]\nVxWorks.TimerMode=OneShot\n", "has no key 'VxWorks.TimerMode'"},
        BadFile{"[ComponentManager]\nComponent.x=a.so\n", "has no key 'Component.x'"},
        BadFile{"[ComponentManager]\nComponent.65=a.so\n", "N from 0 to 64"},
        BadFile{"[ComponentManager]\nComponent.1=\n", "names no file"},
        BadFile{"[ComponentManager]\nComponent.1=a.so\nComponent.01=b.so\n", "given twice"},
        BadFile{"SchedulerInterval=1000\n",
                "line1.cfg:1: 'SchedulerInterval' stands before the first [Section]"},
        BadFile{"[CmpSchedule]\nwhat is this\n", "line1.cfg:2: neither [Section] nor Key=Value"},
        BadFile{"[CmpSchedule\n", "line1.cfg:1: neither"}));

TEST(Settings, RefusesALineBeyondTheBoundAndZeroBytes) {
  const std::string fits = "[X]\n;" + std::string(kMaxSettingsLine - 1, 'x') + "\n";
  EXPECT_EQ(complaint(fits), "");
  EXPECT_THAT(complaint("[X]\n;" + std::string(kMaxSettingsLine, 'x') + "\n"),
              HasSubstr("line1.cfg:2: the line is"));
  EXPECT_THAT(complaint(std::string_view("[X]\nA=\0\n", 8)), HasSubstr("line1.cfg:2: holds a zero byte"));
}

TEST(Settings, NamesAFileThatIsNotThereOrNoFile) {
  EXPECT_EQ(read_settings("/nonexistent.cfg").error().code, ErrorCode::not_found);
  EXPECT_EQ(read_settings("/").error().code, ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace plchost
