#include "instances/io/modbus/client/device_state.hpp"

#include <chrono>
#include <utility>

#include <gtest/gtest.h>

namespace plchost::modbus {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint kFirstPoll = TimePoint() + 1h;

Quality shown_quality(const DeviceState& state, TimePoint now, Duration good_for = 1s) {
  return static_cast<Quality>(state.status(now, good_for).quality);
}

DeviceState& polled_at(DeviceState& state, TimePoint now, Quality quality = Quality::good) {
  state.read(now);
  state.polled(quality, 0);
  return state;
}

TEST(DeviceState, InputsThatAreTooOldAreNotGood) {
  DeviceState state;
  EXPECT_EQ(shown_quality(state, kFirstPoll), Quality::none);
  polled_at(state, kFirstPoll);
  EXPECT_EQ(shown_quality(state, kFirstPoll + 999ms), Quality::good);
  EXPECT_EQ(shown_quality(state, kFirstPoll + 1s), Quality::lost);
  EXPECT_EQ(shown_quality(state, kFirstPoll + 1h, Duration::max()), Quality::good) << "they stay as they are";
  EXPECT_EQ(state.status(kFirstPoll + 2h, 1s).age_ms, 7'200'000U);
}

// They are zeros until the end of the poll puts others into the images.
TEST(DeviceState, AReadingIsGoodOnceItIsInTheImages) {
  DeviceState state;
  polled_at(state, kFirstPoll);
  ASSERT_TRUE(state.is_older(kFirstPoll + 1s, 1s));
  state.read(kFirstPoll + 1s);
  EXPECT_EQ(shown_quality(state, kFirstPoll + 1s), Quality::lost);
  state.polled(Quality::good, 0);
  EXPECT_EQ(shown_quality(state, kFirstPoll + 1s), Quality::good);
}

// Of two threads, one has made them zero. The other one has looked at the clock before.
TEST(DeviceState, AnEarlierClockDoesNotMakeZerosGood) {
  DeviceState state;
  polled_at(state, kFirstPoll);
  ASSERT_TRUE(state.is_older(kFirstPoll + 1s, 1s));
  EXPECT_EQ(shown_quality(state, kFirstPoll + 999ms), Quality::lost);
}

TEST(DeviceState, AnExceptionAndALossStayThemselves) {
  for (const Quality told : {Quality::lost, Quality::exception}) {
    DeviceState state;
    polled_at(state, kFirstPoll, told);
    EXPECT_EQ(shown_quality(state, kFirstPoll), told);
    EXPECT_EQ(shown_quality(state, kFirstPoll + 1s), told);
  }
}

}  // namespace
}  // namespace plchost::modbus
