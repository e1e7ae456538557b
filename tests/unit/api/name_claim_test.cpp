#include "api/server/name_claim.hpp"

#include <gtest/gtest.h>

#include "api/server/status/host_load.hpp"

namespace plchost {
namespace {

NameHolder holder(const std::string& place, std::int64_t since_ns, bool serving) {
  return {.server = {}, .epoch = 7, .since_ns = since_ns, .serving = serving, .place = place, .machine = ""};
}

TEST(NameClaim, IsLeftByExactlyOneOfTwoHosts) {
  for (const bool a_serves : {false, true}) {
    for (const bool b_serves : {false, true}) {
      for (const std::int64_t since : {1, 2, 3}) {
        const NameHolder a = holder("a", 2, a_serves);
        const NameHolder b = holder("b", since, b_serves);
        EXPECT_NE(yields(a, b), yields(b, a)) << a_serves << b_serves << since;
      }
    }
  }
}

TEST(NameClaim, OfWhoServesGoesBeforeThatOfWhoAsks) {
  EXPECT_FALSE(yields(holder("a", 2, true), holder("b", 1, false)));
  EXPECT_TRUE(yields(holder("a", 1, false), holder("b", 2, true)));
}

TEST(NameClaim, OfTheOlderOfTwoThatServeCounts) {
  EXPECT_TRUE(yields(holder("a", 2, true), holder("b", 1, true)));
  EXPECT_FALSE(yields(holder("a", 1, true), holder("b", 2, true)));
}

TEST(NameClaim, OfAServerThatWasReplacedIsNoRival) {
  EXPECT_FALSE(yields(holder("a", 2, false), holder("a", 1, true)));
}

TEST(HostLoad, IsWhatTheKernelTells) {
  EXPECT_EQ(load_percent("0.52 1.00 2.00 3/400 1234\n"), 52);
  EXPECT_EQ(load_percent("12.07 1.00"), 1207);
  EXPECT_EQ(load_percent("0.00"), 0);
  for (const char* none : {"nonsense", "", "-1.00 1", "0.52x 1", "1e300 1", "99999999999 1", "nan 1"}) {
    EXPECT_EQ(load_percent(none), -1) << none;
  }
  const std::string text = "MemTotal:       24576 kB\nMemFree:  1 kB\nMemAvailable:    2048 kB\n";
  EXPECT_EQ(memory_mib(text, "MemTotal"), 24U);
  EXPECT_EQ(memory_mib(text, "MemAvailable"), 2U);
  EXPECT_EQ(memory_mib(text, "Buffers"), 0U);
  EXPECT_EQ(memory_mib("MemTotal: lots", "MemTotal"), 0U);
  EXPECT_EQ(memory_mib("MemTotal:", "MemTotal"), 0U);
}

}  // namespace
}  // namespace plchost
