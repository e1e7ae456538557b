#include "instances/runtime/setup/idle_states.hpp"

#include <string>

#include <fcntl.h>
#include <gmock/gmock.h>

#include "tests/unit/instances/fake_sysfs.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class IdleStatesTest : public testing::Test {
 protected:
  [[nodiscard]] IdleHold take(IdleStates wanted, const std::vector<int>& cores = {1}) const {
    return IdleHold::take(wanted, cores, files_.run_directory(), {files_.sysfs(), files_.device()});
  }
  [[nodiscard]] bool device_holds_zero() const {
    return FakeSysfs::read(files_.device()) == std::string(4, '\0');
  }
  FakeSysfs files_;
};

TEST_F(IdleStatesTest, AreHeldForAllCoresByTheDevice) {
  files_.add_core(1, "0\n");
  const auto sut = take(IdleStates::hold);
  EXPECT_EQ(sut.status(), "held for all cores");
  EXPECT_TRUE(sut.as_wanted());
  EXPECT_TRUE(device_holds_zero());
  EXPECT_EQ(files_.latency(1), "0");
}

TEST_F(IdleStatesTest, AreHeldForTheCoresOfTheInstanceOnly) {
  for (const int core : {0, 1, 2}) files_.add_core(core, "0\n");
  {
    const auto sut = take(IdleStates::hold_core, {1, 2});
    EXPECT_EQ(sut.status(), "held for core 1,2");
    EXPECT_TRUE(sut.as_wanted());
    EXPECT_EQ(files_.latency(0), "0");
    EXPECT_EQ(files_.latency(1), "n/a");
    EXPECT_EQ(files_.latency(2), "n/a");
    EXPECT_FALSE(device_holds_zero());
  }
  EXPECT_EQ(files_.latency(1), "0");
  EXPECT_EQ(files_.latency(2), "0");
}

TEST_F(IdleStatesTest, AreAllowedWhenAskedFor) {
  files_.add_core(1, "0\n");
  const auto sut = take(IdleStates::allow);
  EXPECT_EQ(sut.status(), "allowed");
  EXPECT_TRUE(sut.as_wanted());
  EXPECT_FALSE(device_holds_zero());
  EXPECT_EQ(files_.latency(1), "0");
}

TEST_F(IdleStatesTest, SayWhyTheyAreNotHeld) {
  std::filesystem::remove(files_.device());
  const auto sut = take(IdleStates::hold);
  EXPECT_FALSE(sut.as_wanted());
  EXPECT_THAT(sut.status(), StartsWith("not held: cannot open " + files_.device()));
}

TEST_F(IdleStatesTest, AreHeldForAllCoresWhereTheKernelCannotDoEach) {
  files_.add_core(1, "0\n");  // and none for core 2
  const auto sut = take(IdleStates::hold_core, {1, 2});
  EXPECT_FALSE(sut.as_wanted());
  EXPECT_THAT(sut.status(), StartsWith("held for all cores; not for each core: cannot open "));
  EXPECT_TRUE(device_holds_zero());
  EXPECT_EQ(files_.latency(1), "0");
}

TEST_F(IdleStatesTest, AreHeldForAllCoresWhereNothingCanBeWrittenDown) {
  files_.add_core(1, "0\n");
  const auto sut = IdleHold::take(IdleStates::hold_core, {1}, "", {files_.sysfs(), files_.device()});
  EXPECT_FALSE(sut.as_wanted());
  EXPECT_THAT(sut.status(), HasSubstr("no run directory"));
  EXPECT_TRUE(device_holds_zero());
  EXPECT_EQ(files_.latency(1), "0");
}

TEST_F(IdleStatesTest, OfAKilledInstanceArePutBackByTheNextWhateverItWants) {
  files_.add_core(1, "n/a\n");
  FakeSysfs::write(files_.record(1), "250");
  const auto sut = take(IdleStates::allow);
  EXPECT_EQ(files_.latency(1), "250");
  EXPECT_TRUE(files_.records_are_gone());
}

TEST_F(IdleStatesTest, OfThisHostAreHeldByItsDevice) {
  if (::access("/dev/cpu_dma_latency", W_OK) != 0)
    GTEST_SKIP() << "/dev/cpu_dma_latency is not ours to write";
  const auto sut = IdleHold::take(IdleStates::hold, {0}, "", {});
  EXPECT_EQ(sut.status(), "held for all cores");
  const UniqueFd reader(::open("/dev/cpu_dma_latency", O_RDONLY | O_CLOEXEC));
  std::int32_t limit = -1;
  ASSERT_EQ(::read(reader.get(), &limit, sizeof limit), static_cast<ssize_t>(sizeof limit));
  EXPECT_EQ(limit, 0);
}

}  // namespace
}  // namespace plchost
