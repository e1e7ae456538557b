// CmpSchedule and its fellows on the ticks of a clock device.
#include "tests/conformance/scheduler_fixture.hpp"
#include "tests/support/fake_clock_device.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;
using testing::HasSubstr;
using Kind = FakeClockDevice::Kind;

constexpr nanoseconds k1024Hertz(976'563);

class AuxiliaryTicks : public testing::Test, public ManualTasks {
 protected:
  AuxiliaryTicks() { devices = &device; }
  void TearDown() override { finish(); }

  static SchedulerSettings settings(Duration tick) {
    SchedulerSettings settings;
    settings.tick_source = TickSourceKind::auxiliary;
    settings.auxiliary_device = "/dev/rtc7";
    settings.scheduler_interval = tick;
    return settings;
  }

  void add_noting(Duration interval) {
    add(cyclic("main", interval, [this] { starts.push_back(clock.now()); }));
  }

  FakeClockDevice device{clock, Kind::hpet};
  Starts starts;
};

TEST_F(AuxiliaryTicks, CyclesFollowTheFrequencyOfTheDevice) {
  device.drift = 200e-6;
  add_noting(milliseconds(2));
  ASSERT_TRUE(create());
  const TimePoint origin = start("CmpSchedule", settings(milliseconds(1)));
  EXPECT_EQ(set->tick_report().source, "Auxiliary /dev/rtc7 (HPET, 1000 Hz)");
  clock.run_until(origin + seconds(100));
  // 100 s of CLOCK_MONOTONIC are 100.02 s of the device: 10 cycles more than the clock would make.
  EXPECT_NEAR(static_cast<double>(starts.size()), 50'010, 2);
  EXPECT_EQ(counters(0).lost_cycles, 0U);
}

TEST_F(AuxiliaryTicks, LatencyIsMeasuredFromTheDevicesOwnTimeHoweverFarItDrifts) {
  for (const double drift : {200e-6, -200e-6}) {
    device.drift = drift;
    add(cyclic(drift > 0 ? "fast" : "slow", milliseconds(2), [] {}));
  }
  device.drift = -200e-6;
  ASSERT_TRUE(create());
  const TimePoint origin = start("CmpSchedule", settings(milliseconds(1)));
  clock.run_until(origin + seconds(60));
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_LT(counters(i).latency_last_ns, 2000) << "the device is 12 ms behind by now";
    EXPECT_GE(counters(i).latency_last_ns, 0);
    EXPECT_EQ(counters(i).lost_cycles, 0U);
  }
}

TEST_F(AuxiliaryTicks, IntervalThatIsNoMultipleOfTheTickKeepsTheGridOfTheClock) {
  device.drift = 200e-6;
  add_noting(nanoseconds(1'300'000));
  ASSERT_TRUE(create());
  const TimePoint origin = start("CmpSchedule", settings(milliseconds(1)));
  clock.run_until(origin + nanoseconds(1'300'000) * 10'000 + milliseconds(1));
  EXPECT_EQ(starts.size(), 10'001U);
  EXPECT_EQ(counters(0).lost_cycles, 0U);
}

TEST_F(AuxiliaryTicks, RtcTicksWithAPowerOfTwo) {
  FakeClockDevice rtc(clock, Kind::rtc);
  devices = &rtc;
  add_noting(milliseconds(125));
  ASSERT_TRUE(create());
  const TimePoint origin = start("CmpSchedule", settings(k1024Hertz));
  EXPECT_EQ(set->tick_report().source, "Auxiliary /dev/rtc7 (RTC, 1024 Hz)");
  clock.run_until(origin + seconds(10) + milliseconds(1));
  EXPECT_EQ(starts.size(), 81U);
  finish();
}

TEST_F(AuxiliaryTicks, DeviceThatIsMissingOrUnfitIsReplacedByTheSystemsClockWithTheReason) {
  add_noting(milliseconds(1));
  ASSERT_TRUE(create());
  device.absent = true;
  TimePoint origin = start("CmpSchedule", settings(milliseconds(1)));
  EXPECT_EQ(set->tick_report().source, "System");
  EXPECT_THAT(set->tick_report().fallback, HasSubstr("cannot open /dev/rtc7"));
  clock.run_until(origin + milliseconds(10));
  EXPECT_EQ(starts, grid(origin, milliseconds(1), 11));
  ASSERT_TRUE(set->stop(seconds(10)));
  device.absent = false;
  origin = start("CmpSchedule", settings(nanoseconds(700'000)));
  EXPECT_THAT(set->tick_report().fallback, HasSubstr("cannot tick every 700 us"));
  ASSERT_TRUE(set->stop(seconds(10)));
  start("CmpSchedule", settings(milliseconds(1)));
  EXPECT_THAT(set->tick_report().source, HasSubstr("Auxiliary"));
  EXPECT_EQ(set->tick_report().fallback, "");
}

struct Failure {
  const char* name;
  void (*happens)(FakeClockDevice&);
  const char* text;
  Duration until_noticed;
};

class FailingDevice : public AuxiliaryTicks, public testing::WithParamInterface<Failure> {};

TEST_P(FailingDevice, IsLeftForTheSystemsClockAndTheCyclesGoOn) {
  add_noting(milliseconds(2));
  ASSERT_TRUE(create());
  const TimePoint origin = start("CmpSchedule", settings(milliseconds(1)));
  clock.run_until(origin + seconds(2));
  EXPECT_EQ(set->tick_report().fallback, "");
  GetParam().happens(device);
  clock.run_for(GetParam().until_noticed);
  EXPECT_EQ(set->tick_report().source, "System");
  EXPECT_THAT(set->tick_report().fallback, HasSubstr(GetParam().text));
  const std::size_t before = starts.size();
  clock.run_for(seconds(1));
  EXPECT_NEAR(static_cast<double>(starts.size() - before), 500, 2);
  for (std::size_t i = before + 2; i < starts.size(); ++i)
    EXPECT_EQ(starts[i] - starts[i - 1], milliseconds(2));
}

INSTANTIATE_TEST_SUITE_P(
    Each, FailingDevice,
    testing::Values(Failure{"Silent", [](FakeClockDevice& device) { device.silent = true; },
                            "has not ticked for 10 periods and 1 s", milliseconds(1015)},
                    Failure{"Broken", [](FakeClockDevice& device) { device.broken = true; },
                            "can no longer be read", milliseconds(5)}),
    [](const auto& tested) { return tested.param.name; });

TEST_F(AuxiliaryTicks, DeviceThatDoesNotKeepItsFrequencyIsLeft) {
  device.drift = -0.3;
  add_noting(milliseconds(2));
  ASSERT_TRUE(create());
  const TimePoint origin = start("CmpSchedule", settings(milliseconds(1)));
  clock.run_until(origin + seconds(1));
  EXPECT_EQ(set->tick_report().fallback, "") << "behind by less than 10 periods and 1 s";
  clock.run_for(seconds(4));
  EXPECT_THAT(set->tick_report().fallback, HasSubstr("/dev/rtc7 does not keep its frequency"));
  const std::size_t before = starts.size();
  clock.run_for(seconds(1));
  EXPECT_NEAR(static_cast<double>(starts.size() - before), 500, 2);
}

TEST_F(AuxiliaryTicks, ExchangeOfTheSchedulerLeavesTheDeviceInPhase) {
  add_noting(milliseconds(2));
  add(event("edge", [] { return false; }, [] {}));
  ASSERT_TRUE(create());
  const TimePoint origin = start("CmpSchedule", settings(milliseconds(1)));
  clock.run_until(origin + milliseconds(101));
  for (const auto* const name : {"CmpScheduleTimer", "CmpSchedule", "CmpScheduleTimer", "CmpSchedule"}) {
    std::thread switching([&] { ASSERT_TRUE(set->switch_to(name, settings(milliseconds(1)))); });
    switching.join();
    clock.run_for(milliseconds(50));
  }
  EXPECT_EQ(device.enabled, 1);
  EXPECT_EQ(counters(0).lost_cycles, 0U);
  for (std::size_t i = 2; i < starts.size(); ++i) {
    EXPECT_NEAR(static_cast<double>((starts[i] - starts[i - 1]).count()), 2e6, 2e4) << i;
  }
  ASSERT_TRUE(set->stop(seconds(10)));
  EXPECT_EQ(device.disabled, 1) << "it is not needed while nothing runs";
}

TEST_F(AuxiliaryTicks, DeviceIsOffUnderASchedulerThatNeedsNoTicks) {
  add_noting(milliseconds(2));
  ASSERT_TRUE(create());
  clock.run_until(start("CmpSchedule", settings(milliseconds(1))) + milliseconds(11));
  const auto switch_to = [&](const char* name) {
    std::thread switching([&] { ASSERT_TRUE(set->switch_to(name, settings(milliseconds(1)))); });
    switching.join();
    EXPECT_THAT(set->still_busy(MonotonicClock::now() + seconds(30)), testing::IsEmpty());
    clock.run_for(milliseconds(10));
  };
  switch_to("CmpScheduleTimer");
  EXPECT_EQ(device.disabled, 1);
  switch_to("CmpSchedule");
  EXPECT_EQ(device.enabled, 2);
  EXPECT_EQ(device.disabled, 1);
}

TEST_F(AuxiliaryTicks, OneShotIsRefusedAtTheStartAndAtASwitchWithTheReason) {
  FakeClockDevice rtc(clock, Kind::rtc);
  devices = &rtc;
  add_noting(milliseconds(2));
  ASSERT_TRUE(create());
  const auto refused = set->start("CmpScheduleOneShot", settings(k1024Hertz));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::unsupported);
  EXPECT_THAT(refused.error().message, HasSubstr("/dev/rtc7 only has frequencies that are powers of two"));
  const auto prepared = set->prepare("CmpScheduleOneShot", settings(k1024Hertz));
  ASSERT_FALSE(prepared) << "before anything is kept for the start";
  EXPECT_EQ(prepared.error().message, refused.error().message);
  EXPECT_TRUE(set->prepare("CmpSchedule", settings(k1024Hertz)));
  const TimePoint origin = start("CmpSchedule", settings(k1024Hertz));
  clock.run_until(origin + milliseconds(20));
  const auto switched = set->switch_to("CmpScheduleOneShot", settings(k1024Hertz));
  ASSERT_FALSE(switched);
  EXPECT_EQ(switched.error().code, ErrorCode::unsupported);
  EXPECT_EQ(set->scheduler_name(), "CmpSchedule");
  const std::size_t before = starts.size();
  clock.run_for(milliseconds(20));
  EXPECT_GT(starts.size(), before) << "the one before goes on";
  finish();
}

// The device is busy at first, and then the scheduler would not have it.
TEST_F(AuxiliaryTicks, AStartThatIsPreparedDoesNotFailWhateverBecomesOfTheDevice) {
  device.absent = true;
  add_noting(milliseconds(2));
  ASSERT_TRUE(create());
  auto prepared = set->prepare("CmpScheduleOneShot", settings(milliseconds(1)));
  ASSERT_TRUE(prepared) << prepared.error().describe();
  device.absent = false;
  const auto refused = set->prepare("CmpScheduleOneShot", settings(milliseconds(1)));
  ASSERT_FALSE(refused);
  const TimePoint origin = clock.now() + TaskSet::kStartLead;
  set->start(*std::move(prepared));
  clock.run_until(origin + milliseconds(10));
  EXPECT_EQ(starts, grid(origin, milliseconds(2), 6));
}

TEST_F(AuxiliaryTicks, OneShotRunsOnTheSystemsClockIfTheDeviceIsNotThere) {
  device.absent = true;
  add_noting(milliseconds(2));
  ASSERT_TRUE(create());
  const TimePoint origin = start("CmpScheduleOneShot", settings(milliseconds(1)));
  clock.run_until(origin + milliseconds(10));
  EXPECT_EQ(starts, grid(origin, milliseconds(2), 6));
}

}  // namespace
}  // namespace plchost
