#include "instances/runtime/settings/reference_name.hpp"

#include <gtest/gtest.h>

namespace plchost {
namespace {

using Kind = ReferenceName::Kind;

TEST(ReferenceName, IsAClockOfTheHostOrARecord) {
  for (const auto* const text : {"realtime", "Realtime", "REALTIME"}) {
    ASSERT_TRUE(parse_reference(text));
    EXPECT_EQ(parse_reference(text)->kind, Kind::realtime);
  }
  EXPECT_EQ(parse_reference("Tai")->kind, Kind::tai);
  for (const auto* const path : {"/dev/ptp0", "/dev/ptp_kvm", "/dev/by-name/eth0.1"}) {
    const auto name = parse_reference(std::string("ptp:") + path);
    ASSERT_TRUE(name) << path;
    EXPECT_EQ(name->kind, Kind::device);
    EXPECT_EQ(name->text, path);
  }
  for (const auto* const record : {"bus1", "tai1", "realtime.1", "ptp0", "PTP"}) {
    const auto name = parse_reference(record);
    ASSERT_TRUE(name) << record;
    EXPECT_EQ(name->kind, Kind::record);
    EXPECT_EQ(name->text, record);
  }
}

TEST(ReferenceName, RefusesAllElse) {
  for (const auto* const text :
       {"", "ptp:", "ptp:0", "ptp:ptp0", "ptp:/dev", "ptp:/dev/", "ptp:/dev/ptp0/", "ptp:/dev/../etc/passwd",
        "ptp:/tmp/ptp0", "ptp:/dev/ptp 0", "PTP:/dev/ptp0", "/dev/ptp0", "a/b", "tai:", "clock:realtime"}) {
    EXPECT_FALSE(parse_reference(text)) << text;
  }
  EXPECT_TRUE(parse_reference("ptp:/dev/" + std::string(86, 'p'))) << "95 characters, as a record's name";
  EXPECT_FALSE(parse_reference("ptp:/dev/" + std::string(87, 'p')));
}

}  // namespace
}  // namespace plchost
