#include "api/server/status/findings_collector.hpp"

#include <gmock/gmock.h>

namespace plchost {
namespace {

const std::vector<HostFinding> kAll{{"a", FindingLevel::ok, "s", "f", "w", ""},
                                    {"b", FindingLevel::note, "s", "f", "w", "c"},
                                    {"c", FindingLevel::warning, "s", "f", "w", "c"}};

std::string part(std::uint64_t check, std::size_t first) {
  return encode_part(check, kAll, first, 1);  // one finding in each part
}

TEST(FindingsCollector, AsksUntilAllPartsAreThere) {
  FindingsCollector sut;
  EXPECT_EQ(*sut.add(part(1, 0)).value(), "1");
  EXPECT_EQ(*sut.add(part(1, 1)).value(), "2");
  EXPECT_FALSE(sut.add(part(1, 2)).value());
  ASSERT_EQ(sut.findings().size(), 3U);
  EXPECT_EQ(sut.findings()[2].id, "c");
}

TEST(FindingsCollector, BeginsAnewWhenSomebodyElseHadTheHostChecked) {
  FindingsCollector sut;
  (void)sut.add(part(1, 0));
  EXPECT_EQ(*sut.add(part(2, 1)).value(), "") << "another check: from the start";
  EXPECT_TRUE(sut.findings().empty());
  EXPECT_EQ(*sut.add(part(3, 0)).value(), "1");
  EXPECT_EQ(*sut.add(part(3, 1)).value(), "2");
}

TEST(FindingsCollector, GivesUpWhenThatGoesOn) {
  FindingsCollector sut;
  std::uint64_t check = 1;
  for (int i = 0; i < FindingsCollector::kMaxRestarts; ++i) {
    (void)sut.add(part(check++, 0));
    ASSERT_TRUE(sut.add(part(check++, 1)));
  }
  (void)sut.add(part(check++, 0));
  const auto last = sut.add(part(check, 1));
  ASSERT_FALSE(last);
  EXPECT_EQ(last.error().code, ErrorCode::busy);
}

TEST(FindingsCollector, RefusesPartsThatDoNotFit) {
  FindingsCollector sut;
  EXPECT_EQ(sut.add("garbage").error().code, ErrorCode::corrupt);
  EXPECT_EQ(sut.add(part(1, 1)).error().code, ErrorCode::corrupt) << "does not begin at the beginning";
  (void)sut.add(part(1, 0));
  EXPECT_EQ(sut.add(part(1, 0)).error().code, ErrorCode::corrupt);
  EXPECT_EQ(sut.add(R"({"check":1,"total":3,"first":1,"findings":[]})").error().code, ErrorCode::corrupt);
}

}  // namespace
}  // namespace plchost
