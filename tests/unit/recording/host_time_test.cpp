// A host's clock, measured by requests and their answers.
#include "api/recording/host_time.hpp"

#include <gmock/gmock.h>

namespace plchost {
namespace {

constexpr std::int64_t kUs = 1000;
constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kSecond = 1'000'000'000;

TimePoint at(std::int64_t ns) {
  return TimePoint(Duration(ns));
}

/// A request at `asked` that took so long there and back.
void add_answer(HostTimeSamples& sut, std::int64_t asked, std::int64_t there, std::int64_t back,
                std::int64_t offset) {
  sut.add(at(asked), at(asked + there + back), asked + there + offset);
}

TEST(HostTime, IsUnknownWithoutSamples) {
  EXPECT_FALSE(HostTimeSamples().result());
}

TEST(HostTime, TheFastestAnswerCounts) {
  HostTimeSamples sut;
  add_answer(sut, 1 * kSecond, 3 * kMs, 100 * kUs, 5 * kSecond);
  add_answer(sut, 1 * kSecond + kMs, 60 * kUs, 40 * kUs, 5 * kSecond);
  add_answer(sut, 1 * kSecond + 2 * kMs, 100 * kUs, 4 * kMs, 5 * kSecond);
  const HostTime time = sut.result().value();
  EXPECT_EQ(time.uncertainty_ns, 50 * kUs);
  EXPECT_EQ(time.offset_ns, 5 * kSecond + 10 * kUs);
  EXPECT_EQ(time.drift, 0);
  EXPECT_EQ(time.here(6 * kSecond), 1 * kSecond - 10 * kUs);
}

TEST(HostTime, ADriftThatIsMoreThanTheUncertaintyIsFollowed) {
  HostTimeSamples sut;
  for (std::int64_t second = 0; second <= 100; ++second)
    add_answer(sut, second * kSecond, 10 * kUs, 10 * kUs, kSecond + second * 50 * kUs);  // 50 ppm
  const HostTime time = sut.result().value();
  EXPECT_NEAR(time.drift, 50e-6, 1e-6);
  for (const std::int64_t second : {0, 33, 100}) {
    const std::int64_t here = time.here(second * kSecond + kSecond + second * 50 * kUs);
    EXPECT_NEAR(static_cast<double>(here), static_cast<double>(second * kSecond), 20.0 * kUs);
  }
}

TEST(HostTime, AChangeWithinTheUncertaintyIsNoDrift) {
  HostTimeSamples sut;
  add_answer(sut, 1 * kSecond, 10 * kUs, 90 * kUs, 0);
  add_answer(sut, 3 * kSecond, 90 * kUs, 10 * kUs, 0);
  EXPECT_EQ(sut.result()->drift, 0);
}

TEST(HostTime, ClocksOfAStrangerLeadNowhere) {
  HostTimeSamples sut;
  sut.add(at(kSecond), at(kSecond + 2), INT64_MAX);
  sut.add(at(kSecond), at(kSecond + 2), -1);
  EXPECT_FALSE(sut.result());
  sut.add(at(kSecond), at(kSecond + 2), INT64_MAX / 4);
  sut.add(at(2 * kSecond), at(2 * kSecond + 2), 0);
  const HostTime time = sut.result().value();
  EXPECT_EQ(time.drift, 0) << "no computer's clock is so wrong";
  EXPECT_GE(time.here(INT64_MAX), 0);
  EXPECT_GE(time.here(INT64_MIN), 0);
}

}  // namespace
}  // namespace plchost
