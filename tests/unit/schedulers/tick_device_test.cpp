#include "schedulers/tick/tick_device.hpp"

#include <cerrno>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/fake_clock_device.hpp"
#include "tests/support/manual_clock.hpp"

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::nanoseconds;
using testing::HasSubstr;
using Kind = FakeClockDevice::Kind;

struct Fixture {
  explicit Fixture(Kind kind) : files(clock, kind) { sut = TickDevice::open(files, "/dev/rtc7").value(); }
  ManualClock clock;
  FakeClockDevice files;
  std::shared_ptr<TickDevice> sut;
};

TEST(TickDevice, AsksTheDeviceWhatItIs) {
  EXPECT_EQ(Fixture(Kind::rtc).sut->frequencies(), "that are powers of two");
  EXPECT_EQ(Fixture(Kind::hpet).sut->frequencies(), "in whole hertz");
  ManualClock clock;
  FakeClockDevice files(clock, Kind::neither);
  const auto refused = TickDevice::open(files, "/dev/null");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::unsupported);
  EXPECT_THAT(refused.error().message, HasSubstr("/dev/null is no clock with periodic interrupts"));
}

TEST(TickDevice, RtcMakesExactlyThePowersOfTwo) {
  Fixture rtc(Kind::rtc);
  for (unsigned long hertz = 2; hertz <= 8192; hertz *= 2) {
    const auto period = nanoseconds(static_cast<long>(1e9 / static_cast<double>(hertz) + 0.5));
    EXPECT_TRUE(rtc.sut->set_period(period)) << hertz;
    EXPECT_EQ(rtc.files.frequency, hertz);
  }
}

TEST(TickDevice, PeriodThatItCannotMakeIsRefusedWithTheNearest) {
  Fixture rtc(Kind::rtc);
  const auto refused = rtc.sut->set_period(microseconds(1000));
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("/dev/rtc7 cannot tick every 1000 us"));
  EXPECT_THAT(refused.error().message, HasSubstr("976.5625 us (1024 Hz) and 1953.125 us (512 Hz)"));
  EXPECT_THAT(rtc.sut->set_period(std::chrono::seconds(1)).error().message, HasSubstr("500000 us (2 Hz)"));
  EXPECT_THAT(rtc.sut->set_period(microseconds(50)).error().message, HasSubstr("122.0703125 us (8192 Hz)"));
  Fixture hpet(Kind::hpet);
  EXPECT_TRUE(hpet.sut->set_period(microseconds(1000)));
  EXPECT_EQ(hpet.files.frequency, 1000U);
  EXPECT_THAT(hpet.sut->set_period(microseconds(700)).error().message,
              HasSubstr("(1429 Hz) and 700.280112 us (1428 Hz)"));
}

TEST(TickDevice, SaysWhatToDoIfTheFrequencyIsNotAllowed) {
  Fixture rtc(Kind::rtc);
  rtc.files.refuses_frequency = EACCES;
  const auto refused = rtc.sut->set_period(nanoseconds(976'563));
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().describe(), HasSubstr("CAP_SYS_RESOURCE"));
}

TEST(TickDevice, CountsTheTicksOfEachKind) {
  for (const Kind kind : {Kind::rtc, Kind::hpet}) {
    Fixture device(kind);
    ASSERT_TRUE(device.sut->set_period(std::chrono::milliseconds(500)));
    ASSERT_TRUE(device.sut->run());
    EXPECT_EQ(device.sut->take(), 0U);
    device.clock.run_for(std::chrono::milliseconds(2600));
    EXPECT_EQ(device.sut->take(), 5U);
    EXPECT_EQ(device.sut->take(), 0U);
  }
}

TEST(TickDevice, KeepsItsPhaseForTheNextScheduler) {
  Fixture device(Kind::rtc);
  ASSERT_TRUE(device.sut->set_period(nanoseconds(976'563)));
  ASSERT_TRUE(device.sut->run());
  ASSERT_TRUE(device.sut->set_period(nanoseconds(976'563)));
  ASSERT_TRUE(device.sut->run());
  EXPECT_EQ(device.files.enabled, 1);
  EXPECT_EQ(device.files.disabled, 0);
  device.sut->halt();
  EXPECT_EQ(device.files.disabled, 1);
}

// A scheduler that is only planned must not stop the one that runs.
TEST(TickDevice, KeepsItsPeriodWhileItTicks) {
  Fixture device(Kind::hpet);
  ASSERT_TRUE(device.sut->set_period(microseconds(1000)));
  ASSERT_TRUE(device.sut->run());
  const auto refused = device.sut->set_period(microseconds(2000));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::wrong_state);
  EXPECT_EQ(device.files.disabled, 0);
  EXPECT_EQ(device.sut->frequency(), 1000U);
  device.clock.run_for(std::chrono::milliseconds(10));
  EXPECT_EQ(device.sut->take(), 10U);
  device.sut->halt();
  EXPECT_TRUE(device.sut->set_period(microseconds(2000)));
  EXPECT_EQ(device.sut->frequency(), 500U);
}

TEST(TickDevice, IsSwitchedOffAndClosedAtTheEnd) {
  Fixture device(Kind::hpet);
  ASSERT_TRUE(device.sut->set_period(microseconds(1000)));
  ASSERT_TRUE(device.sut->run());
  device.sut.reset();
  EXPECT_EQ(device.files.disabled, 1);
  EXPECT_EQ(device.files.opened, 0);
}

TEST(LinuxDeviceFile, IsBrokenWhenItReadsNothing) {
  auto sut = linux_device_files().open("/dev/null");
  ASSERT_TRUE(sut) << sut.error().describe();
  errno = EAGAIN;  // of something else, before
  EXPECT_EQ((*sut)->read(), std::nullopt);
}

}  // namespace
}  // namespace plchost
