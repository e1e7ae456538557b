// A real instance follows the reference clock of the example firmware, in a process of its own.
#include "shm/pages/reference_clock.hpp"

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/files/pool_files.hpp"
#include "tests/integration/instances/instance_process.hpp"

namespace plchost::testing {
namespace {

using ::testing::HasSubstr;

constexpr const char* kRecord = "bus1";
// As ClockState numbers them, for readers of the page.
enum State : std::uint32_t { free_running = 1, acquiring = 2, locked = 3, hold_over = 4, measuring = 5 };

/// The example's firmware. Killed when it goes, as if its power were cut.
class ClockFirmware {
 public:
  ClockFirmware(const Sandbox& sandbox, std::vector<std::string> options) {
    std::vector<std::string> all{REFERENCE_CLOCK, "--pool", sandbox.pool(), "--name", kRecord};
    all.insert(all.end(), options.begin(), options.end());
    std::vector<char*> argv;
    for (std::string& argument : all) argv.push_back(argument.data());
    argv.push_back(nullptr);
    EXPECT_EQ(posix_spawn(&pid_, REFERENCE_CLOCK, nullptr, nullptr, argv.data(), environ), 0);
  }
  ~ClockFirmware() {
    ::kill(pid_, SIGKILL);
    int status = 0;
    ::waitpid(pid_, &status, 0);
  }
  ClockFirmware(const ClockFirmware&) = delete;
  ClockFirmware& operator=(const ClockFirmware&) = delete;

 private:
  pid_t pid_ = -1;
};

class FollowingFirmware : public ::testing::Test {
 protected:
  ~FollowingFirmware() override { ReferenceClockRecord::remove(sandbox_.pool(), kRecord); }

  void start(const std::string& settings = {}) {
    const std::string file =
        sandbox_.write("line1.cfg", fmt::format("[DistributedClock]\nReference={}\n{}", kRecord, settings));
    sut.emplace(sandbox_, std::vector<std::string>{"--scheduler", "CmpScheduleOneShot", "--settings", file,
                                                   "--application", application("all_kinds")});
    sut->wait_until_up();
  }
  [[nodiscard]] ClockRuntime clock() const {
    const auto page = InstancePageReader::open(sandbox_.pool(), "line1");
    const auto runtime = page ? page->runtime() : std::nullopt;
    return runtime ? runtime->clock : ClockRuntime{};
  }
  [[nodiscard]] bool becomes(State state) const {
    return eventually([&] { return clock().state == state; });
  }
  [[nodiscard]] bool is_told(std::string_view problem) const {
    return eventually([&] { return clock().problem.view().starts_with(problem); });
  }
  [[nodiscard]] std::string record_file() const {
    return fmt::format("{}/{}", MemoryFile::kDirectory, pool_memory_name(sandbox_.pool(), kRecord));
  }
  void write_record(const std::string& bytes) const { std::ofstream(record_file()) << bytes; }
  /// Of the last release of the 2 ms task, by the line through one pair of the firmware.
  [[nodiscard]] double deviation_ns(double drift) const {
    const auto record = ReferenceClockRecord::open(sandbox_.pool(), kRecord).value();
    plc_reference_reading pair{};
    EXPECT_TRUE(
        eventually([&] { return plc_reference_clock_read(&record.record(), &pair) == PLC_REFERENCE_OK; }));
    const auto task = sut->task("Fast");
    const double since = static_cast<double>(task->counters.release_ns - pair.local_ns) * (1 + drift);
    constexpr std::int64_t kInterval = 2'000'000;
    const double phase = static_cast<double>(pair.reference_ns % kInterval) + since;
    return phase - std::round(phase / kInterval) * kInterval;
  }

  Sandbox sandbox_;
  std::optional<InstanceProcess> sut;
};

TEST_F(FollowingFirmware, LocksHoldsOverAndLocksAgain) {
  start();
  EXPECT_TRUE(becomes(free_running)) << "the record is there, but nobody writes it";
  EXPECT_EQ(clock().reference.view(), kRecord);
  {
    const ClockFirmware firmware(sandbox_, {"--drift", "100", "--noise", "0", "--offset", "700"});
    EXPECT_TRUE(becomes(locked)) << sut->log();
    EXPECT_TRUE(eventually([&] { return std::abs(clock().drift_ppb - 100'000) < 1000; }));
    EXPECT_TRUE(eventually([&] { return std::abs(deviation_ns(100e-6)) < 1000; }));
    EXPECT_EQ(clock().in_sync, 1U);
  }
  EXPECT_TRUE(becomes(hold_over));
  EXPECT_EQ(clock().in_sync, 1U) << "the last drift is good for a while";
  EXPECT_TRUE(is_told("the reference clock is silent")) << clock().problem.view();
  const auto pairs = clock().pairs;
  const ClockFirmware again(sandbox_, {"--drift", "-150", "--noise", "200", "--offset", "-300"});
  EXPECT_TRUE(eventually([&] { return clock().pairs > pairs + 500; }));
  EXPECT_TRUE(becomes(locked));
  EXPECT_TRUE(eventually([&] { return std::abs(clock().drift_ppb + 150'000) < 2000; }));
  EXPECT_TRUE(eventually([&] { return std::abs(deviation_ns(-150e-6)) < 1000; }));
  EXPECT_LE(clock().correction_max_ns, 20'000) << "1 % of 2 ms, whatever happened";
  EXPECT_TRUE(eventually([&] { return clock().problem.view().empty(); })) << clock().problem.view();
  EXPECT_THAT(sut->log(), HasSubstr("the reference clock is followed again"));
  EXPECT_GT(clock().corrections_at_bound, 0U);
}

TEST_F(FollowingFirmware, HoldsTheClockThoughPairsAreWildAndItSteps) {
  start("MaxCorrectionNs=5000\n");
  const ClockFirmware firmware(sandbox_, {"--wild", "5", "--step", "400", "--step-every", "1"});
  EXPECT_TRUE(becomes(locked));
  EXPECT_TRUE(eventually([&] { return clock().steps >= 2 && clock().rejected > 20; }));
  EXPECT_TRUE(becomes(locked));
  EXPECT_LE(clock().correction_max_ns, 5000);
}

TEST_F(FollowingFirmware, MeasuresOnlyUnderASchedulerThatMovesNoRelease) {
  start();
  const ClockFirmware firmware(sandbox_, {"--drift", "60"});
  EXPECT_TRUE(becomes(locked));
  EXPECT_EQ(sut->ask(ControlVerb::set_scheduler, "CmpScheduleTimer").code, ErrorCode::ok);
  EXPECT_TRUE(becomes(measuring));
  EXPECT_EQ(clock().in_sync, 0U);
  EXPECT_EQ(sut->ask(ControlVerb::set_scheduler, "CmpScheduleOneShot").code, ErrorCode::ok);
  EXPECT_TRUE(becomes(locked));
}

TEST_F(FollowingFirmware, FollowsARecordThatWasMadeAnew) {
  start();
  EXPECT_TRUE(becomes(free_running));
  ReferenceClockRecord::remove(sandbox_.pool(), kRecord);
  const ClockFirmware firmware(sandbox_, {});
  EXPECT_TRUE(becomes(locked)) << sut->log();
}

TEST_F(FollowingFirmware, EmptiedRecordIsNoCauseOfDeath) {
  start();
  for (int i = 0; i < 3; ++i) {
    const ClockFirmware firmware(sandbox_, {});  // which may die of it: it has no guard
    EXPECT_TRUE(becomes(locked)) << sut->log();
    std::filesystem::resize_file(record_file(), 0);
    EXPECT_TRUE(eventually([&] { return std::filesystem::file_size(record_file()) == 64; }))
        << "begun anew by the instance";
  }
  EXPECT_TRUE(becomes(hold_over)) << sut->log();
  EXPECT_TRUE(is_told("the reference clock is silent")) << clock().problem.view();
  const ClockFirmware again(sandbox_, {});
  EXPECT_TRUE(becomes(locked)) << sut->log();
}

TEST_F(FollowingFirmware, RecordThatWasEmptiedBeforeTheStartIsBegunAnew) {
  write_record("");
  start();
  EXPECT_TRUE(becomes(free_running));
  EXPECT_TRUE(is_told("the reference clock is silent")) << clock().problem.view();
  const ClockFirmware firmware(sandbox_, {});
  EXPECT_TRUE(becomes(locked)) << sut->log();
}

TEST_F(FollowingFirmware, RunsFreelyBesideAMemoryThatIsNoRecordUntilThereIsOne) {
  for (const std::size_t size : {std::size_t{10}, std::size_t{64}, std::size_t{4096}}) {
    write_record(std::string(size, '\xa5'));
    start();
    EXPECT_TRUE(becomes(free_running));
    EXPECT_THAT(std::string(clock().problem.view()), HasSubstr("is no reference record of version 1"));
    EXPECT_THAT(sut->log(), HasSubstr("the clock runs freely"));
    ReferenceClockRecord::remove(sandbox_.pool(), kRecord);
    const ClockFirmware firmware(sandbox_, {});
    EXPECT_TRUE(becomes(locked)) << sut->log();
    EXPECT_TRUE(eventually([&] { return clock().problem.view().empty(); })) << clock().problem.view();
  }
}

TEST_F(FollowingFirmware, RecordThatIsOverwrittenIsLetGo) {
  start();
  {
    const ClockFirmware firmware(sandbox_, {});
    EXPECT_TRUE(becomes(locked)) << sut->log();
  }
  std::fstream(record_file()) << std::string(64, '\xa5');
  EXPECT_TRUE(becomes(hold_over));
  EXPECT_TRUE(eventually([&] { return !clock().problem.view().empty(); }));
  ReferenceClockRecord::remove(sandbox_.pool(), kRecord);
  const ClockFirmware again(sandbox_, {});
  EXPECT_TRUE(becomes(locked)) << sut->log();
}

}  // namespace
}  // namespace plchost::testing
