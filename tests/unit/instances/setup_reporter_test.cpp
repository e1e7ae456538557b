#include "instances/runtime/setup/setup_reporter.hpp"

#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

namespace plchost {
namespace {

using ::testing::StartsWith;

class LongReport : public ::testing::TestWithParam<char> {};

TEST_P(LongReport, ArrivesCutToItsPacket) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0, ends.data()), 0);
  PacketSocket reader{UniqueFd(ends[0])};
  SetupReporter sut(ends[1]);
  sut.failed(SetupStep::read_settings,
             Error{ErrorCode::invalid_argument, 0, "line1.cfg:1: " + std::string(1'000'000, GetParam())});
  const auto packet = reader.receive();
  ASSERT_TRUE(packet && *packet);
  const auto report = decode_report(**packet);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->step, SetupStep::read_settings);
  EXPECT_EQ(report->code, ErrorCode::invalid_argument);
  EXPECT_THAT(report->text, StartsWith("line1.cfg:1: "));
  EXPECT_GT(report->text.size(), 1000U);
}

// As JSON, one byte of them takes 1, 2, 6 and 3.
INSTANTIATE_TEST_SUITE_P(Bytes, LongReport, ::testing::Values('x', '"', '\x01', '\xff'));

}  // namespace
}  // namespace plchost
