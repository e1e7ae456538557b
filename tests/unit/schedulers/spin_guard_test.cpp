#include "schedulers/activation/spin_guard.hpp"

#include <gtest/gtest.h>

namespace plchost {
namespace {

using std::chrono::microseconds;

TEST(SpinGuard, SettlesAboveASteadyLatency) {
  SpinGuard sut(microseconds(100));
  for (int i = 0; i < 20'000; ++i) sut.record(microseconds(20));
  EXPECT_GE(sut.value(), microseconds(20) - SpinGuard::kDown);
  EXPECT_LE(sut.value(), microseconds(20) + SpinGuard::kUp);
}

TEST(SpinGuard, ComesUpFasterThanItGoesDown) {
  SpinGuard sut(microseconds(100));
  for (int i = 0; i < 20'000; ++i) sut.record(microseconds(10));
  int up = 0;
  for (; sut.value() < microseconds(60); ++up) sut.record(microseconds(60));
  int down = 0;
  for (; sut.value() > microseconds(15); ++down) sut.record(microseconds(10));
  EXPECT_LT(up, 20);
  EXPECT_GT(down, 50 * up);
}

TEST(SpinGuard, IsLateInFewerThanOneOfAHundred) {
  SpinGuard sut(microseconds(100));
  int late = 0;
  std::uint32_t random = 1;
  for (int i = 0; i < 100'000; ++i) {
    random = random * 1'664'525U + 1'013'904'223U;
    const auto latency = microseconds(15) + Duration(random >> 18);  // 15 to 31 us
    late += i > 10'000 && latency > sut.value() ? 1 : 0;
    sut.record(latency);
  }
  EXPECT_LT(late, 900);
}

TEST(SpinGuard, NeverExceedsItsBound) {
  SpinGuard sut(microseconds(30));
  for (int i = 0; i < 1000; ++i) {
    sut.record(microseconds(30));
    ASSERT_LE(sut.value(), microseconds(30));
  }
}

TEST(SpinGuard, IgnoresLatenciesThatNoGuardCanCover) {
  SpinGuard sut(microseconds(100));
  for (int i = 0; i < 20'000; ++i) sut.record(microseconds(10));
  const Duration before = sut.value();
  for (int i = 0; i < 1000; ++i) sut.record(std::chrono::milliseconds(3));
  EXPECT_EQ(sut.value(), before);
}

TEST(SpinGuard, BoundOfZeroSwitchesItOff) {
  SpinGuard sut{Duration::zero()};
  for (int i = 0; i < 1000; ++i) sut.record(microseconds(i % 50));
  EXPECT_EQ(sut.value(), Duration::zero());
}

}  // namespace
}  // namespace plchost
