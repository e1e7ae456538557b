// A real instance follows a clock of its host. The PTP device is preloaded into it.
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/timex.h>

#include "schedulers/distributed_clock/distributed_clock.hpp"
#include "tests/integration/instances/instance_process.hpp"
#include "tests/integration/instances/simulated_phc.hpp"

namespace plchost::testing {
namespace {

using ::testing::HasSubstr;

constexpr const char* kPtpDevice = "/dev/ptp-of-a-test";
constexpr std::int64_t kPtpInterval = 2'000'000;

class HostClockAsReference : public ::testing::Test {
 protected:
  void start(const std::string& reference, const std::string& more = {}) {
    const std::string file =
        sandbox_.write("line1.cfg", fmt::format("[DistributedClock]\nReference={}\n{}", reference, more));
    const std::vector<std::string> environment{
        "LD_PRELOAD=" + application("simulated_phc"), "ASAN_OPTIONS=verify_asan_link_order=0",
        std::string("SIMULATED_PHC_PATH=") + kPtpDevice, "SIMULATED_PHC_FILE=" + phc_file(),
        "SIMULATED_PHC_GONE=" + gone_file()};
    sut.emplace(sandbox_,
                std::vector<std::string>{"--scheduler", "CmpScheduleOneShot", "--settings", file,
                                         "--application", application("all_kinds")},
                environment);
    sut->wait_until_up();
  }
  void start_on_device() { start(std::string("ptp:") + kPtpDevice); }
  // In one step: the device never sees half of it.
  void write_phc(std::int64_t drift_ppb, std::int64_t offset_ns, const std::string& way) const {
    std::filesystem::rename(sandbox_.write("phc.new", fmt::format("{} {} {}\n", drift_ppb, offset_ns, way)),
                            phc_file());
  }
  void take_away() const { (void)sandbox_.write("gone", ""); }
  void give_back() const { std::filesystem::remove(gone_file()); }

  [[nodiscard]] ClockRuntime clock() const { return sut->runtime().clock; }
  [[nodiscard]] bool becomes(ClockState state) const {
    return eventually([&] { return clock().state == std::to_underlying(state); });
  }
  [[nodiscard]] bool tells(const std::string& problem) const {
    return eventually([&] { return clock().problem.view().find(problem) != std::string_view::npos; });
  }
  /// How far the last release of the 2 ms task is from the device's grid.
  [[nodiscard]] std::int64_t phase_ns() const {
    const std::int64_t release = sut->task("Fast")->counters.release_ns;
    return SimulatedPhc::read(phc_file().c_str()).phase_ns(release, kPtpInterval);
  }
  [[nodiscard]] std::string phc_file() const { return sandbox_.folder() + "/phc"; }
  [[nodiscard]] std::string gone_file() const { return sandbox_.folder() + "/gone"; }

  Sandbox sandbox_;
  std::optional<InstanceProcess> sut;
};

TEST_F(HostClockAsReference, IsADeviceInEachOfTheWaysThatItCanBeRead) {
  const std::pair<const char*, const char*> ways[] = {{"precise", "PTP_SYS_OFFSET_PRECISE"},
                                                      {"extended", "PTP_SYS_OFFSET_EXTENDED"},
                                                      {"none", "clock_gettime"}};
  for (const auto& [way, told] : ways) {
    write_phc(120'000, 0, way);
    start_on_device();
    EXPECT_TRUE(becomes(ClockState::locked)) << way << sut->log();
    EXPECT_TRUE(eventually([&] { return std::abs(clock().drift_ppb - 120'000) < 2000; })) << way;
    EXPECT_TRUE(eventually([&] { return std::abs(phase_ns()) < 2000; })) << way;
    EXPECT_EQ(clock().reference.view(), std::string("ptp:") + kPtpDevice);
    EXPECT_TRUE(eventually([&] { return clock().problem.view().empty(); })) << clock().problem.view();
    EXPECT_THAT(sut->log(), HasSubstr(fmt::format("follow {} ({})", kPtpDevice, told)));
    EXPECT_EQ(sut->end(SIGTERM), 0);
  }
}

TEST_F(HostClockAsReference, DeviceThatIsSetIsFollowedAtTheBoundedPace) {
  write_phc(-50'000, 0, "extended");
  start_on_device();
  EXPECT_TRUE(becomes(ClockState::locked)) << sut->log();
  write_phc(-50'000, 700'000, "extended");
  EXPECT_TRUE(eventually([&] { return clock().steps == 1; }));
  EXPECT_TRUE(eventually([&] { return clock().in_sync == 1 && std::abs(phase_ns()) < 2000; }));
  EXPECT_LE(clock().correction_max_ns, 20'000) << "1 % of 2 ms";
}

TEST_F(HostClockAsReference, DeviceThatGoesIsHoldOverUntilItIsThereAgain) {
  write_phc(80'000, 0, "extended");
  take_away();
  start_on_device();
  EXPECT_TRUE(becomes(ClockState::free_running));
  EXPECT_TRUE(tells(std::string("open ") + kPtpDevice)) << clock().problem.view();
  EXPECT_THAT(sut->log(), HasSubstr("the clock runs freely"));
  give_back();
  EXPECT_TRUE(becomes(ClockState::locked)) << sut->log();
  EXPECT_TRUE(eventually([&] { return clock().problem.view().empty(); })) << clock().problem.view();
  take_away();
  EXPECT_TRUE(becomes(ClockState::hold_over));
  EXPECT_TRUE(eventually([&] { return !clock().problem.view().empty(); }));
  EXPECT_EQ(clock().in_sync, 1U) << "the last drift is good for a while";
  give_back();
  EXPECT_TRUE(becomes(ClockState::locked)) << sut->log();
}

// It is read without an error, and shows the same time each time.
TEST_F(HostClockAsReference, DeviceThatStandsStillIsToldUntilItGoesAgain) {
  write_phc(-1'000'000'000, 0, "extended");
  start_on_device();
  EXPECT_TRUE(tells("the reference clock stands still")) << clock().problem.view();
  EXPECT_TRUE(becomes(ClockState::free_running));
  write_phc(80'000, 0, "extended");
  EXPECT_TRUE(becomes(ClockState::locked)) << sut->log();
  EXPECT_TRUE(eventually([&] { return clock().problem.view().empty(); })) << clock().problem.view();
  write_phc(-1'000'000'000, 0, "extended");
  EXPECT_TRUE(tells("the reference clock stands still")) << clock().problem.view();
  EXPECT_TRUE(becomes(ClockState::hold_over));
  EXPECT_THAT(sut->log(), HasSubstr("the reference clock stands still"));
}

TEST_F(HostClockAsReference, DeviceOfAnotherKindIsRefusedAndTheInstanceRuns) {
  for (const char* const path : {"/dev/null", "/dev/shm"}) {
    start(std::string("ptp:") + path);
    EXPECT_TRUE(becomes(ClockState::free_running));
    EXPECT_TRUE(tells(fmt::format("{} is no PTP clock", path))) << clock().problem.view();
    EXPECT_EQ(sut->end(SIGTERM), 0);
  }
}

TEST_F(HostClockAsReference, IsTheTimeOfDay) {
  start("realtime");
  EXPECT_TRUE(becomes(ClockState::locked)) << sut->log();
  // The two clocks have the same pace, so one reading tells where the grid lies.
  const auto phase = [&] {
    const std::int64_t ahead = unix_time_ns() - MonotonicClock::now().time_since_epoch().count();
    const std::int64_t since = (sut->task("Fast")->counters.release_ns + ahead) % kPtpInterval;
    return since > kPtpInterval / 2 ? since - kPtpInterval : since;
  };
  EXPECT_TRUE(eventually([&] { return std::abs(phase()) < 2000; })) << phase();
  EXPECT_EQ(clock().in_sync, 1U);
}

TEST_F(HostClockAsReference, IsTaiOnlyIfTheKernelKnowsIt) {
  timex kernel{};
  (void)::adjtimex(&kernel);
  start("TAI");
  if (kernel.tai != 0) {
    EXPECT_TRUE(becomes(ClockState::locked)) << sut->log();
    return;
  }
  EXPECT_TRUE(becomes(ClockState::free_running));
  EXPECT_TRUE(tells("the kernel's TAI offset is 0")) << clock().problem.view();
}

}  // namespace
}  // namespace plchost::testing
