#include "instances/runtime/time/host_clock.hpp"

#include <cerrno>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/ptp_clock.h>
#include <sys/stat.h>

#include "instances/runtime/time/host_reference.hpp"
#include "tests/support/own_name.hpp"
#include "tests/unit/instances/fake_clock_system.hpp"

namespace plchost {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using Kind = ReferenceName::Kind;

class HostClockTest : public testing::Test {
 protected:
  [[nodiscard]] std::unique_ptr<HostClock> open(Kind kind) {
    return HostClock::open(system, {.kind = kind, .text = "/dev/ptp0"}).value();
  }
  /// How far a look is from the truth.
  [[nodiscard]] std::int64_t error_ns(const HostClock::Look& look, std::int64_t ahead_ns) const {
    return look.pair.reference_ns - look.pair.local.time_since_epoch().count() - ahead_ns;
  }
  FakeClockSystem system;
};

TEST_F(HostClockTest, OfSeveralReadingsTheOneBetweenTheNearestTwoCounts) {
  const auto sut = open(Kind::realtime);
  EXPECT_EQ(sut->describe(), "CLOCK_REALTIME");
  system.delays = {9us, 100us, 100us, 9us, 100us, 9us, 200us, 1us, 1us, 1us, 50us, 9us, 9us, 9us, 9us};
  const auto look = sut->look();
  ASSERT_TRUE(look);
  EXPECT_EQ(look->width, 2us);
  EXPECT_EQ(error_ns(*look, FakeClockSystem::kRealtimeAhead), 0);
}

TEST_F(HostClockTest, ThatCannotBeReadIsAnErrorWithItsName) {
  const auto sut = open(Kind::realtime);
  system.realtime_error = EPERM;
  const auto look = sut->look();
  ASSERT_FALSE(look);
  EXPECT_THAT(look.error().describe(), HasSubstr("read CLOCK_REALTIME"));
}

TEST_F(HostClockTest, TaiThatNobodyHasSetIsNone) {
  const auto sut = open(Kind::tai);
  EXPECT_THAT(sut->look().error().message, HasSubstr("the kernel's TAI offset is 0"));
  system.tai = 37;
  const auto look = sut->look();
  ASSERT_TRUE(look);
  EXPECT_EQ(error_ns(*look, FakeClockSystem::kRealtimeAhead + 37'000'000'000), 0);
  system.tai = 0;
  EXPECT_FALSE(sut->look()) << "somebody has taken it back";
}

TEST_F(HostClockTest, DeviceIsReadInTheBestWayThatItHas) {
  system.precise = EOPNOTSUPP;
  const auto sut = open(Kind::device);
  auto look = sut->look();
  ASSERT_TRUE(look) << look.error().describe();
  EXPECT_EQ(sut->describe(), "/dev/ptp0 (PTP_SYS_OFFSET_EXTENDED)");
  EXPECT_LE(std::abs(error_ns(*look, FakeClockSystem::kPhcAhead)), look->width.count() / 2);
  system.extended = ENOTTY;
  look = sut->look();
  ASSERT_TRUE(look);
  EXPECT_EQ(sut->describe(), "/dev/ptp0 (clock_gettime)");
  EXPECT_LE(std::abs(error_ns(*look, FakeClockSystem::kPhcAhead)), look->width.count() / 2);
  EXPECT_EQ(system.asked_precise, 1) << "the driver lacks it, so it is not asked for again";
  system.precise = 0;
  const auto other = open(Kind::device);
  look = other->look();
  ASSERT_TRUE(look);
  EXPECT_EQ(other->describe(), "/dev/ptp0 (PTP_SYS_OFFSET_PRECISE)");
  EXPECT_LE(std::abs(error_ns(*look, FakeClockSystem::kPhcAhead)), look->width.count() / 2);
}

TEST_F(HostClockTest, DeviceThatRefusesForAMomentIsReadInTheNextWayMeanwhile) {
  const auto sut = open(Kind::device);
  system.precise = ETIMEDOUT;
  ASSERT_TRUE(sut->look());
  EXPECT_EQ(sut->describe(), "/dev/ptp0 (PTP_SYS_OFFSET_PRECISE)");
  system.precise = 0;
  ASSERT_TRUE(sut->look());
  EXPECT_EQ(system.asked_precise, 2);
}

TEST_F(HostClockTest, DeviceThatIsGoneIsAnError) {
  const auto sut = open(Kind::device);
  system.precise = system.extended = system.device_error = ENODEV;
  const auto look = sut->look();
  ASSERT_FALSE(look);
  EXPECT_EQ(look.error().system_errno, ENODEV);
}

TEST_F(HostClockTest, TimesThatAreNoneAreLeftOut) {
  const auto sut = open(Kind::device);
  for (const ptp_clock_time& time : {ptp_clock_time{.sec = 5, .nsec = 1'000'000'000, .reserved = 0},
                                     ptp_clock_time{.sec = INT64_MAX, .nsec = 0, .reserved = 0},
                                     ptp_clock_time{.sec = INT64_MIN, .nsec = 0, .reserved = 0}}) {
    system.phc_shows = time;
    const auto look = sut->look();
    ASSERT_FALSE(look);
    EXPECT_EQ(look.error().message, "/dev/ptp0 shows a time that is none");
  }
}

TEST_F(HostClockTest, TimeOfDayThatIsSetMeanwhileIsNoPair) {
  system.precise = EOPNOTSUPP;
  const auto sut = open(Kind::device);
  ASSERT_TRUE(sut->look());
  for (const Duration by : {Duration(-1h), Duration(40us), Duration(1h)}) {
    system.at_control = [&] { system.realtime_set_by += by; };
    const auto look = sut->look();
    ASSERT_FALSE(look) << by.count();
    EXPECT_EQ(look.error().code, ErrorCode::busy);
    system.at_control = nullptr;
    ASSERT_TRUE(sut->look());
  }
}

TEST(WidthWatch, LeavesOutWhatIsFarWiderThanUsualUntilThatIsUsual) {
  WidthWatch sut;
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(sut.takes(1us));
  EXPECT_TRUE(sut.takes(3us));
  EXPECT_FALSE(sut.takes(50us));
  EXPECT_TRUE(sut.takes(1us));
  int looks = 0;
  while (!sut.takes(50us)) ++looks;
  EXPECT_GT(looks, 5);
  EXPECT_LT(looks, 40);
}

TEST(LinuxClockSystem, OpensNothingButAPtpClock) {
  const std::string folder = own_path("clocks");
  ASSERT_EQ(::mkdir(folder.c_str(), 0700), 0);
  const std::string pipe = folder + "/pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& path : {std::string("/dev/null"), std::string("/dev"), pipe}) {
    const auto refused = linux_clock_system().open(path);
    ASSERT_FALSE(refused) << path;
    EXPECT_EQ(refused.error().code, ErrorCode::wrong_type);
    EXPECT_EQ(refused.error().message, path + " is no PTP clock: only devices of /sys/class/ptp are");
  }
  const auto missing = linux_clock_system().open(folder + "/ptp9");
  EXPECT_EQ(missing.error().system_errno, ENOENT);
  ::unlink(pipe.c_str());
  ::rmdir(folder.c_str());
}

class HostReferenceTest : public testing::Test {
 protected:
  HostReferenceTest() {
    follower = &clock.add_follower(0);
    DistributedClockSettings settings;
    settings.reference_timeout = 1h;  // the fake clock's stamps are not of today
    clock.configure(settings);
  }
  void follow() { sut.emplace(clock, system, ReferenceName{.kind = Kind::device, .text = "/dev/ptp0"}, 1ms); }
  /// As the task would: the newest pair is read when it plans its next release.
  [[nodiscard]] bool eventually(const std::function<bool()>& condition) {
    for (const TimePoint end = MonotonicClock::now() + 20s; MonotonicClock::now() < end;) {
      (void)follower->correction(system.now(), 1ms, {}, system.now());
      sut->refresh();
      if (condition()) return true;
      ::usleep(500);
    }
    return false;
  }
  [[nodiscard]] ClockStatus status() const { return clock.status(*follower); }

  FakeClockSystem system;
  DistributedClock clock;
  ClockFollower* follower = nullptr;
  std::optional<HostReference> sut;
};

TEST_F(HostReferenceTest, GivesPairsToTheTasks) {
  follow();
  EXPECT_TRUE(eventually([&] { return status().pairs > 20; }));
  EXPECT_EQ(status().drift_ppb, 0);
  EXPECT_EQ(status().rejected, 0U);
  EXPECT_EQ(sut->problem(), "");
}

TEST_F(HostReferenceTest, SaysWhyThereIsNoClockAndTriesAgain) {
  system.missing = true;
  follow();
  EXPECT_TRUE(
      eventually([&] { return sut->problem() == "open /dev/ptp0: No such file or directory (ENOENT)"; }));
  EXPECT_EQ(status().pairs, 0U);
  system.missing = false;
  EXPECT_TRUE(eventually([&] { return status().pairs > 0 && sut->problem().empty(); }));
}

TEST_F(HostReferenceTest, ReadsTenTimesInTheTimeoutWithinBounds) {
  EXPECT_EQ(HostReference::period(50ms), 5ms);
  EXPECT_EQ(HostReference::period(1ms), 1ms);
  EXPECT_EQ(HostReference::period(1h), 10ms);
}

}  // namespace
}  // namespace plchost
