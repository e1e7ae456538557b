#include "instances/launch/core_latency.hpp"

#include <csignal>
#include <fstream>
#include <optional>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/file.h>
#include <sys/wait.h>

#include "tests/unit/instances/fake_sysfs.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class CoreLatency : public testing::Test {
 protected:
  CoreLatency() { files_.add_core(1, "0\n"); }
  [[nodiscard]] Result<CoreLatencyHold> take(int core = 1) const {
    return CoreLatencyHold::take(files_.sysfs(), files_.run_directory(), core);
  }
  [[nodiscard]] std::vector<std::string> restore() const {
    return restore_core_latency(files_.sysfs(), files_.run_directory()).value();
  }
  /// Another process takes the hold and is killed while it has it.
  void take_and_be_killed() const {
    int ready[2];  // NOLINT(modernize-avoid-c-arrays): pipe's
    ASSERT_EQ(::pipe2(ready, O_CLOEXEC), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      const auto hold = take();
      (void)!::write(ready[1], hold ? "y" : "n", 1);
      for (;;) ::pause();
    }
    char answer = 0;
    ASSERT_EQ(::read(ready[0], &answer, 1), 1);
    EXPECT_EQ(answer, 'y');
    ::kill(child, SIGKILL);
    ASSERT_EQ(::waitpid(child, nullptr, 0), child);
    ::close(ready[0]);
    ::close(ready[1]);
  }

  FakeSysfs files_;
};

// Root writes its text into the kernel's file.
TEST_F(CoreLatency, IsNotRestoredFromARecordOfAnotherUser) {
  if (::geteuid() != 0) GTEST_SKIP() << "to give files to another user needs root";
  files_.add_core(1, "150\n");
  std::ofstream(files_.record(1)) << "7";
  ASSERT_EQ(::chown(files_.record(1).c_str(), 65534, 65534), 0);
  EXPECT_THAT(restore(), IsEmpty());
  EXPECT_EQ(files_.latency(1), "150");
  EXPECT_FALSE(take());
}

TEST_F(CoreLatency, IsHeldAndThenAsBefore) {
  files_.add_core(1, "150\n");
  {
    const auto sut = take();
    ASSERT_TRUE(sut) << sut.error().describe();
    EXPECT_EQ(files_.latency(1), "n/a");
    EXPECT_EQ(FakeSysfs::read(files_.record(1)), "150");
  }
  EXPECT_EQ(files_.latency(1), "150");
  EXPECT_TRUE(files_.records_are_gone());
}

TEST_F(CoreLatency, IsPutBackByTheLastOfSeveralHolders) {
  auto first = std::optional(take().value());
  auto second = std::optional(take().value());
  first.reset();
  EXPECT_EQ(files_.latency(1), "n/a");
  second.reset();
  EXPECT_EQ(files_.latency(1), "0");
  EXPECT_TRUE(files_.records_are_gone());
}

TEST_F(CoreLatency, IsPutBackAfterAHolderWasKilled) {
  take_and_be_killed();
  EXPECT_EQ(files_.latency(1), "n/a");
  EXPECT_THAT(restore(), ElementsAre(HasSubstr("core 1: its wake-up latency limit is 0 again")));
  EXPECT_EQ(files_.latency(1), "0");
  EXPECT_TRUE(files_.records_are_gone());
  EXPECT_THAT(restore(), IsEmpty());
}

TEST_F(CoreLatency, IsNotPutBackWhileAnotherHolderLives) {
  auto other = std::optional(take().value());
  take_and_be_killed();
  EXPECT_THAT(restore(), IsEmpty());
  EXPECT_EQ(files_.latency(1), "n/a");
  other.reset();
  EXPECT_EQ(files_.latency(1), "0");
}

TEST_F(CoreLatency, OfAKilledHolderIsTakenOverWithWhatWasBeforeIt) {
  take_and_be_killed();
  {
    const auto next = take();
    EXPECT_EQ(FakeSysfs::read(files_.record(1)), "0");
  }
  EXPECT_EQ(files_.latency(1), "0");
}

TEST_F(CoreLatency, KeepsNoLatencyThatSomebodyElseHadAskedFor) {
  files_.add_core(1, "n/a\n");
  {
    const auto sut = take();
  }
  EXPECT_EQ(files_.latency(1), "n/a");
  EXPECT_TRUE(files_.records_are_gone());
}

TEST_F(CoreLatency, IsUntouchedByARecordThatWasOnlyBegun) {
  files_.add_core(1, "7\n");
  FakeSysfs::write(files_.record(1), "");
  EXPECT_THAT(restore(), IsEmpty());
  EXPECT_EQ(files_.latency(1), "7");
  EXPECT_TRUE(files_.records_are_gone());
}

TEST_F(CoreLatency, IsNotGuessedFromASpoiltRecord) {
  files_.add_core(1, "n/a\n");
  FakeSysfs::write(files_.record(1), "-5 or so");
  EXPECT_THAT(restore(), ElementsAre(HasSubstr("is not known")));
  EXPECT_EQ(files_.latency(1), "n/a");
  EXPECT_TRUE(files_.records_are_gone());
}

TEST_F(CoreLatency, LeavesOtherFilesOfTheRunDirectoryAlone) {
  for (const char* name : {"core.latency", "core-1.latency", "corex.latency", "core1.sock", "manager.sock"}) {
    FakeSysfs::write(files_.run_directory() + "/" + name, "0");
  }
  EXPECT_THAT(restore(), IsEmpty());
  EXPECT_TRUE(std::filesystem::exists(files_.run_directory() + "/core.latency"));
  EXPECT_TRUE(std::filesystem::exists(files_.run_directory() + "/core-1.latency"));
}

TEST_F(CoreLatency, IsBusyWhileAnotherProcessWorksOnTheRecords) {
  take_and_be_killed();
  const UniqueFd other(::open(files_.run_directory().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  ASSERT_EQ(::flock(other.get(), LOCK_EX), 0);
  const auto tried = restore_core_latency(files_.sysfs(), files_.run_directory());
  ASSERT_FALSE(tried);
  EXPECT_EQ(tried.error().code, ErrorCode::busy);
}

TEST_F(CoreLatency, IsRefusedWhereTheKernelHasNoSuchFile) {
  const auto sut = take(9);
  ASSERT_FALSE(sut);
  EXPECT_EQ(sut.error().code, ErrorCode::unsupported);
  EXPECT_TRUE(files_.records_are_gone());
}

TEST_F(CoreLatency, IsRefusedWhereTheFileHoldsSomethingElse) {
  files_.add_core(1, "auto\n");
  const auto sut = take();
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error().message, HasSubstr("'auto'"));
  EXPECT_EQ(files_.latency(1), "auto");
  EXPECT_TRUE(files_.records_are_gone());
}

TEST_F(CoreLatency, IsRefusedWithoutARunDirectoryThatIsThere) {
  const auto sut = CoreLatencyHold::take(files_.sysfs(), files_.run_directory() + "/none", 1);
  EXPECT_FALSE(sut);
  EXPECT_EQ(files_.latency(1), "0");
}

TEST_F(CoreLatency, OfThisHostIsHeldAndThenAsBefore) {
  const std::string file = "/sys/devices/system/cpu/cpu0/power/pm_qos_resume_latency_us";
  const UniqueFd turns(::open(file.c_str(), O_RDWR | O_CLOEXEC));
  if (!turns) GTEST_SKIP() << file << " is not there, or not ours to write";
  ASSERT_EQ(::flock(turns.get(), LOCK_EX), 0);  // tests with the real file take turns
  const std::string before = FakeSysfs::read(file);
  {
    const auto sut = CoreLatencyHold::take(std::string(kSysfs), files_.run_directory(), 0);
    ASSERT_TRUE(sut) << sut.error().describe();
    EXPECT_EQ(FakeSysfs::read(file), "n/a\n");
  }
  EXPECT_EQ(FakeSysfs::read(file), before);
}

}  // namespace
}  // namespace plchost
