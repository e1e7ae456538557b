#include "instances/adapters/iec/duration.hpp"

#include <gmock/gmock.h>

namespace plchost::iec {
namespace {

using testing::HasSubstr;

TEST(IecDuration, IsReadWithAllUnits) {
  EXPECT_EQ(nanoseconds_of("T#20ms"), 20'000'000);
  EXPECT_EQ(nanoseconds_of("time#1h2m3s4ms5us6ns"), 3'723'004'005'006);
  EXPECT_EQ(nanoseconds_of("LT#2d"), 172'800'000'000'000);
  EXPECT_EQ(nanoseconds_of("T#1_000us"), 1'000'000);
  EXPECT_EQ(nanoseconds_of("t#1s_500ms"), 1'500'000'000);
  EXPECT_EQ(nanoseconds_of("T#2.5ms"), 2'500'000);
  EXPECT_EQ(nanoseconds_of("T#-1s"), -1'000'000'000);
  EXPECT_EQ(nanoseconds_of("T#0s"), 0);
}

TEST(IecDuration, SaysWhatIsAllowed) {
  for (const char* const wrong : {"", "T#", "20ms", "T#20", "T#ms", "T#1x", "INT#5", "T#1.2.3s", "T#--1s"}) {
    const auto result = nanoseconds_of(wrong);
    ASSERT_FALSE(result) << wrong;
    EXPECT_THAT(result.error(), HasSubstr("allowed is T#20ms")) << wrong;
  }
  const auto too_long = nanoseconds_of("T#200000d");
  ASSERT_FALSE(too_long);
  EXPECT_THAT(too_long.error(), HasSubstr("up to 292 years"));
}

}  // namespace
}  // namespace plchost::iec
