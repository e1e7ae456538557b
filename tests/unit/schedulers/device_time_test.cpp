#include "schedulers/tick/device_time.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace plchost {
namespace {

constexpr std::uint32_t kHertz = 1024;

/// A device whose ticks are seen late, some of them very.
class Device {
 public:
  explicit Device(double drift) : drift_(drift) { sut.begin(kHertz); }

  /// The true time of the next tick, and what the filter takes it for.
  std::pair<TimePoint, TimePoint> tick(std::uint64_t ticks = 1) {
    count_ += ticks;
    const auto when = TimePoint(std::chrono::seconds(1000)) +
                      Duration(std::llround(static_cast<double>(count_) * 1e9 / kHertz / (1 + drift_)));
    const TimePoint seen = when + Duration(2000 + std::llround(latency_(random_)));
    const TimePoint planned = sut.planned(ticks, seen);
    EXPECT_LE(planned, seen);
    return {when, planned};
  }

  DeviceTime sut;

 private:
  double drift_;
  std::uint64_t count_ = 0;
  std::mt19937 random_{7};
  std::exponential_distribution<double> latency_{1.0 / 20'000};  // 20 us at the mean
};

class Drift : public testing::TestWithParam<double> {};

TEST_P(Drift, IsFollowedWithoutTheLatencyOfTheWakeUps) {
  Device device(GetParam());
  for (int i = 0; i < 20'000; ++i) device.tick();
  Duration worst{};
  for (int i = 0; i < 20'000; ++i) {
    const auto [when, planned] = device.tick();
    worst = std::max(worst, Duration(std::abs((planned - when).count())));
  }
  // 2 us of it are the shortest latency that there is.
  EXPECT_LT(worst, std::chrono::microseconds(8)) << "the wake-ups are 22 us late at the mean, and up to 200";
}

INSTANTIATE_TEST_SUITE_P(Ppm, Drift, testing::Values(0.0, 20e-6, -20e-6, 200e-6, -200e-6));

TEST(DeviceTime, FirstTickIsTheAnchor) {
  DeviceTime sut;
  sut.begin(kHertz);
  const TimePoint now(std::chrono::seconds(5));
  EXPECT_EQ(sut.planned(17, now), now);
  EXPECT_EQ(sut.deviation(now), Duration::zero());
}

TEST(DeviceTime, CountsTicksThatNobodySaw) {
  Device device(0);
  device.tick();
  for (int i = 0; i < 500; ++i) device.tick();
  const auto [when, planned] = device.tick(100);
  EXPECT_LT(planned - when, std::chrono::microseconds(8));
  EXPECT_GT(planned - when, std::chrono::microseconds(-8));
}

TEST(DeviceTime, PlannedTimesDoNotJump) {
  Device device(50e-6);
  TimePoint before;
  Duration longest{};
  Duration shortest = std::chrono::hours(1);
  for (int i = 0; i < 20'000; ++i) {
    const TimePoint planned = device.tick().second;
    if (i > 10'000) {
      longest = std::max(longest, planned - before);
      shortest = std::min(shortest, planned - before);
    }
    before = planned;
  }
  EXPECT_LT(longest, std::chrono::nanoseconds(976'563 + 3000));
  EXPECT_GT(shortest, std::chrono::nanoseconds(976'563 - 3000));
}

TEST(DeviceTime, DeviationTellsOfAWrongFrequency) {
  DeviceTime sut;
  sut.begin(1000);
  TimePoint now(std::chrono::seconds(5));
  for (int i = 0; i <= 1000; ++i, now += std::chrono::milliseconds(2)) (void)sut.planned(1, now);
  EXPECT_NEAR(static_cast<double>(sut.deviation(now).count()), 1e9, 5e6);
}

}  // namespace
}  // namespace plchost
