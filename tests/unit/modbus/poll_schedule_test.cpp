#include "instances/io/modbus/threads/poll_schedule.hpp"

#include <gmock/gmock.h>

#include "instances/io/modbus/client/device_state.hpp"
#include "instances/io/modbus/config/endpoint.hpp"

namespace plchost::modbus {
namespace {

using namespace std::chrono_literals;
constexpr TimePoint kStart{1s};

TEST(PollSchedule, StaysOnItsGrid) {
  PollSchedule sut(100ms, 500ms, 2s, kStart);
  EXPECT_EQ(sut.next(), kStart);
  sut.answered(kStart + 30ms);
  EXPECT_EQ(sut.next(), kStart + 100ms);
  sut.answered(kStart + 390ms);
  EXPECT_EQ(sut.next(), kStart + 400ms);
  EXPECT_EQ(sut.skipped(), 2);
}

TEST(PollSchedule, PausesLongerWithEachFailureUpToItsBound) {
  PollSchedule sut(100ms, 500ms, 2s, kStart);
  TimePoint now = kStart;
  for (const auto pause : {500ms, 1000ms, 2000ms, 2000ms}) {
    sut.failed(now);
    EXPECT_EQ(sut.next(), now + pause + 100ms);  // the next time of the grid behind the pause
    now = sut.next();
  }
  sut.answered(now);
  EXPECT_EQ(sut.next(), now + 100ms);
  sut.failed(sut.next());
  EXPECT_EQ(sut.next(), now + 700ms);
}

TEST(PollSchedule, APauseThatIsShorterThanTheIntervalIsKept) {
  PollSchedule sut(10s, 500ms, 2s, kStart);
  sut.failed(kStart + 200ms);
  EXPECT_EQ(sut.next(), kStart + 700ms);
  sut.failed(kStart + 900ms);
  EXPECT_EQ(sut.next(), kStart + 1900ms);
  sut.answered(kStart + 1950ms);
  EXPECT_EQ(sut.next(), kStart + 10s) << "back on the grid";
  EXPECT_EQ(sut.skipped(), 0);
  sut.failed(kStart + 19'800ms);
  EXPECT_EQ(sut.next(), kStart + 20'300ms);
  sut.answered(kStart + 20'400ms);
  EXPECT_EQ(sut.next(), kStart + 30s);
}

TEST(DeviceState, TellsQualityAndAge) {
  DeviceState sut;
  EXPECT_EQ(sut.status(kStart, Duration::max()).age_ms, kNeverRead);
  EXPECT_EQ(sut.status(kStart, Duration::max()).quality, 0);
  EXPECT_TRUE(sut.is_older(kStart, 1h));
  sut.read(kStart);
  sut.polled(Quality::good, 0);
  EXPECT_EQ(sut.status(kStart + 42ms, Duration::max()).age_ms, 42);
  EXPECT_EQ(sut.status(kStart + 42ms, Duration::max()).quality, 1);
  EXPECT_FALSE(sut.is_older(kStart + 42ms, 43ms));
  EXPECT_TRUE(sut.is_older(kStart + 43ms, 43ms));
  sut.polled(Quality::exception, 2);
  sut.polled(Quality::lost, 0);
  EXPECT_EQ(sut.status(kStart, Duration::max()).quality, 2);
  EXPECT_EQ(sut.status(kStart, Duration::max()).exception, 2);
  EXPECT_EQ(sut.status(kStart + 10'000h, Duration::max()).age_ms, kNeverRead - 1);
  sut.polled(Quality::good, 0);
  EXPECT_EQ(sut.status(kStart, Duration::max()).exception, 0);
  const auto counter = sut.status(kStart, Duration::max()).counter;
  sut.count();
  EXPECT_NE(sut.status(kStart, Duration::max()).counter, counter);
}

TEST(ModbusEndpoint, IsNumeric) {
  for (const char* good : {"127.0.0.1", "127.0.0.1:1", "10.0.0.9:65535", "[::1]", "[fd00::1]:502"}) {
    EXPECT_TRUE(parse_endpoint(good).has_value()) << good;
  }
  for (const char* bad : {"", "localhost", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:65536", "1.2.3", "::1",
                          "[::1", "[::1]502", "[1.2.3.4]", "1.2.3.4:5:6", "1.2.3.4 ", "[localhost]:1"}) {
    EXPECT_FALSE(parse_endpoint(bad).has_value()) << bad;
  }
  EXPECT_TRUE(parse_endpoint("127.3.0.1")->is_loopback());
  EXPECT_TRUE(parse_endpoint("[::1]")->is_loopback());
  EXPECT_FALSE(parse_endpoint("0.0.0.0")->is_loopback());
  EXPECT_FALSE(parse_endpoint("[::]")->is_loopback());
  EXPECT_EQ(parse_endpoint("127.3.0.1")->text(), "127.3.0.1:502");
  EXPECT_EQ(parse_endpoint("[::ffff:127.3.0.1]:503")->text(), "127.3.0.1:503");
  EXPECT_EQ(parse_endpoint("[FD00:0::10]")->text(), "[fd00::10]:502");
}

}  // namespace
}  // namespace plchost::modbus
