#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/bench/network_space.hpp"
#include "tests/bench/process_usage.hpp"

namespace plchost::bench {

namespace {

constexpr std::string_view kDevices =
    "Inter-|   Receive                                                |  Transmit\n"
    " face |bytes    packets errs drop fifo frame compressed multicast|bytes    packets errs drop fifo colls "
    "carrier "
    "compressed\n"
    "    lo:    3267      29    0    0    0     0          0         0     3268      30    0    0    0     0 "
    "      0    "
    "      0\n"
    " cable: 9876543210 1234567    1    2    3     4          5         6 77 8    9    9    9     9       9  "
    "        9\n";

TEST(TrafficOfAnInterface, IsReadByItsName) {
  const auto cable = parse_traffic(kDevices, "cable");
  ASSERT_TRUE(cable) << cable.error().describe();
  EXPECT_EQ(cable->received_bytes, 9876543210.0);
  EXPECT_EQ(cable->received_datagrams, 1234567);
  EXPECT_EQ(cable->sent_bytes, 77);
  EXPECT_EQ(cable->sent_datagrams, 8);
  const auto loopback = parse_traffic(kDevices, "lo");
  ASSERT_TRUE(loopback) << loopback.error().describe();
  EXPECT_EQ(loopback->sent_bytes, 3268);
}

TEST(TrafficOfAnInterface, IsAnErrorIfItIsNotThereOrCutShort) {
  EXPECT_EQ(parse_traffic(kDevices, "able").error().code, ErrorCode::not_found);
  EXPECT_EQ(parse_traffic("cable: 1 2 3 4 5 6 7 8 9\n", "cable").error().code, ErrorCode::corrupt);
}

TEST(TrafficOfAnInterface, IsWhatCameBetweenTwoLooks) {
  const Traffic between = Traffic{10, 20, 30, 40} - Traffic{1, 2, 3, 4};
  EXPECT_EQ(between.received_bytes, 9);
  EXPECT_EQ(between.received_datagrams, 18);
  EXPECT_EQ(between.sent_bytes, 27);
  EXPECT_EQ(between.sent_datagrams, 36);
}

TEST(MemoryOfAProcess, IsItsRssAndPss) {
  const auto memory = parse_memory(
      "55d0-7ffd ---p 00000000 00:00 0 [rollup]\n"
      "Rss:                2048 kB\n"
      "Pss:                1536 kB\n"
      "Pss_Dirty:           100 kB\n");
  ASSERT_TRUE(memory) << memory.error().describe();
  EXPECT_EQ(memory->rss_mib, 2);
  EXPECT_EQ(memory->pss_mib, 1.5);
  EXPECT_EQ(parse_memory("head\nRss: 1 kB\n").error().code, ErrorCode::corrupt);
}

TEST(MemoryOfAProcess, IsMoreThanNothingForThisOne) {
  const auto memory = memory_of(::getpid());
  ASSERT_TRUE(memory) << memory.error().describe();
  EXPECT_GT(memory->pss_mib, 0);
  EXPECT_GE(memory->rss_mib, memory->pss_mib);
}

TEST(IdleTime, IsTheFourthColumnOfAllProcessors) {
  const auto idle = parse_idle_time("cpu  10 20 30 400 5 6 7 0 0 0\ncpu0 1 2 3 4 5 6 7 0 0 0\n");
  ASSERT_TRUE(idle) << idle.error().describe();
  EXPECT_EQ(*idle, Duration(std::chrono::seconds(400)) / ::sysconf(_SC_CLK_TCK));
  EXPECT_EQ(parse_idle_time("cpu  10 20 30\n").error().code, ErrorCode::corrupt);
  EXPECT_TRUE(idle_time());
}

TEST(ProcessorTimeOfAProcess, Grows) {
  const auto before = processor_time_of(::getpid());
  ASSERT_TRUE(before) << before.error().describe();
  auto now = processor_time_of(::getpid());
  while (now && *now == *before) now = processor_time_of(::getpid());
  ASSERT_TRUE(now) << now.error().describe();
  EXPECT_GT(*now, *before);
}

}  // namespace

}  // namespace plchost::bench
