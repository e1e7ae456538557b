// A plc-instance on the ticks of a clock device, which is preloaded into it.
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/instances/instance_process.hpp"

namespace plchost::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr const char* kDevice = "/dev/clock-of-a-test";

class AuxiliaryClock : public ::testing::Test {
 protected:
  /// Its settings, and the device: "hpet" at 100 percent of its speed.
  std::vector<std::string> environment(const std::string& kind, int percent = 100) const {
    return {
        "LD_PRELOAD=" + application("clock_device"),       "ASAN_OPTIONS=verify_asan_link_order=0",
        std::string("CLOCK_DEVICE_PATH=") + kDevice,       "CLOCK_DEVICE_KIND=" + kind,
        "CLOCK_DEVICE_PERCENT=" + std::to_string(percent), "CLOCK_DEVICE_STOP=" + sandbox.folder() + "/stop"};
  }
  std::vector<std::string> arguments(const std::string& interval, const std::string& more = "") const {
    const std::string file = sandbox.write(
        "line1.cfg", "[CmpSchedule]\nSchedulerInterval=" + interval +
                         "\n[SysTimer]\nLinux.TimerSource=Auxiliary\nLinux.AuxiliaryDevice=" + kDevice +
                         "\n" + more);
    return {"--settings", file, "--application", application("all_kinds")};
  }
  std::string tick_source() const { return std::string(runtime().tick_source.view()); }
  std::string tick_fallback() const { return std::string(runtime().tick_fallback.view()); }

  InstanceRuntime runtime() const {
    const auto page = InstancePageReader::open(sandbox.pool(), "line1");
    return page ? page->runtime().value_or(InstanceRuntime{}) : InstanceRuntime{};
  }

  Sandbox sandbox;
};

// Releases, whether the machine let them run in time or not.
double cycles_per_second(const InstanceProcess& sut) {
  const auto count = [&] {
    const auto counters = sut.task("Fast")->counters;
    return counters.cycles + counters.lost_cycles;
  };
  // Just behind a cycle: one that a core delays has not counted the releases that were lost by it.
  const auto measure = [&] {
    const auto before = sut.task("Fast")->counters.cycles;
    std::pair now(count(), MonotonicClock::now());
    EXPECT_TRUE(eventually([&] {
      const TimePoint asked = MonotonicClock::now();
      now = {count(), MonotonicClock::now()};
      return sut.task("Fast")->counters.cycles >= before + 2 && now.second - asked < 10ms;
    }));
    return now;
  };
  const auto before = measure();
  std::this_thread::sleep_for(2s);
  const auto after = measure();
  return static_cast<double>(after.first - before.first) /
         std::chrono::duration<double>(after.second - before.second).count();
}

TEST_F(AuxiliaryClock, CyclesComeFromTheDevice) {
  InstanceProcess sut(sandbox, arguments("1000"), environment("hpet", 112));
  sut.wait_until_up();
  EXPECT_EQ(tick_source(), std::string("Auxiliary ") + kDevice + " (HPET, 1000 Hz)");
  EXPECT_EQ(tick_fallback(), "");
  EXPECT_NEAR(cycles_per_second(sut), 560, 25) << "a task of 2 ms on a clock that is 12 % too fast";
  // After 9 s it is 1 s ahead: no clock to go by.
  EXPECT_TRUE(eventually([&] { return tick_source() == "System"; }));
  EXPECT_THAT(tick_fallback(), HasSubstr("does not keep its frequency"));
  EXPECT_NEAR(cycles_per_second(sut), 500, 25);
  EXPECT_EQ(sut.end(SIGTERM), 0);
}

TEST_F(AuxiliaryClock, RtcTicksAtAPowerOfTwo) {
  InstanceProcess sut(sandbox, arguments("976.5625"), environment("rtc"));
  sut.wait_until_up();
  EXPECT_EQ(tick_source(), std::string("Auxiliary ") + kDevice + " (RTC, 1024 Hz)");
  EXPECT_NEAR(cycles_per_second(sut), 500, 25);
  EXPECT_EQ(sut.ask(ControlVerb::set_scheduler, "CmpScheduleTimer").code, ErrorCode::ok);
  EXPECT_EQ(sut.ask(ControlVerb::set_scheduler, "CmpSchedule").code, ErrorCode::ok) << sut.log();
  EXPECT_THAT(tick_source(), HasSubstr("RTC")) << "the device, which can be opened only once, is kept";
  const auto refused = sut.ask(ControlVerb::set_scheduler, "CmpScheduleOneShot");
  EXPECT_EQ(refused.code, ErrorCode::unsupported);
  EXPECT_THAT(refused.text, HasSubstr("powers of two"));
  EXPECT_NEAR(cycles_per_second(sut), 500, 25);
}

TEST_F(AuxiliaryClock, DeviceThatStopsIsLeftForTheSystemsClock) {
  InstanceProcess sut(sandbox, arguments("1000"), environment("hpet"));
  sut.wait_until_up();
  EXPECT_THAT(tick_source(), HasSubstr("Auxiliary"));
  (void)sandbox.write("stop", "");
  EXPECT_TRUE(eventually([&] { return tick_source() == "System"; }));
  EXPECT_EQ(tick_fallback(), std::string(kDevice) + " has not ticked for 10 periods and 1 s");
  EXPECT_NEAR(cycles_per_second(sut), 500, 25);
  EXPECT_THAT(sut.log(),
              HasSubstr("has not ticked for 10 periods and 1 s; the system's clock ticks instead"));
}

TEST_F(AuxiliaryClock, DeviceThatIsMissingOrUnfitIsAnErrorInTheLogAndInTheStatus) {
  {
    InstanceProcess sut(sandbox, arguments("1000"));
    sut.wait_until_up();
    EXPECT_EQ(tick_source(), "System");
    EXPECT_THAT(tick_fallback(), HasSubstr(std::string("cannot open ") + kDevice));
    EXPECT_THAT(sut.log(), HasSubstr(std::string("tick source: cannot open ") + kDevice));
    EXPECT_EQ(sut.end(SIGTERM), 0);
  }
  InstanceProcess sut(sandbox, arguments("1000"), environment("rtc"));
  sut.wait_until_up();
  EXPECT_EQ(tick_source(), "System");
  EXPECT_THAT(tick_fallback(), HasSubstr("976.5625 us (1024 Hz) and 1953.125 us (512 Hz)"));
  EXPECT_NEAR(cycles_per_second(sut), 500, 25);
}

TEST_F(AuxiliaryClock, OneShotOnItIsRefusedAtTheStartAndInATrialWithTheReason) {
  auto all = arguments("976.5625", "Linux.TimerMode=OneShot\n");
  {
    InstanceProcess sut(sandbox, all, environment("rtc"));
    EXPECT_EQ(sut.end(), 3);
    EXPECT_THAT(sut.log(), HasSubstr("start scheduler failed: "));
    EXPECT_THAT(sut.log(), HasSubstr("only has frequencies that are powers of two"));
  }
  all[2] = "--check-application";
  InstanceProcess trial(sandbox, all, environment("rtc"));
  EXPECT_EQ(trial.end(), 3);
  EXPECT_THAT(trial.log(), HasSubstr("only has frequencies that are powers of two"));
  // As long as another process has it, nobody else can open it.
  auto more = environment("rtc");
  more.emplace_back("CLOCK_DEVICE_BUSY=1");
  InstanceProcess beside(sandbox, all, more);
  EXPECT_EQ(beside.end(), 3);
  EXPECT_THAT(beside.log(), HasSubstr("only has frequencies that are powers of two"));
}

}  // namespace
}  // namespace plchost::testing
