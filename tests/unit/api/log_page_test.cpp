#include "api/dds/log_page.hpp"

#include <gmock/gmock.h>

#include "api/cli/rows/log_rows.hpp"
#include "api/dds/text.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

TEST(LogQuery, TravelsAsItIs) {
  EXPECT_EQ(log_query_of(plc_ListPart{}).value().after, 0U);
  EXPECT_EQ(log_query_of(part_of(LogQuery{.after = ~std::uint64_t{0}})).value().after, ~std::uint64_t{0});
  EXPECT_EQ(log_query_of(part_of(LogQuery{.newest = 7})).value().newest, 7U);
}

TEST(LogQuery, RefusesAPlaceBesideANumberOfTheNewest) {
  const auto query = log_query_of(part_of(LogQuery{.after = 1, .newest = 1}));
  ASSERT_FALSE(query);
  EXPECT_THAT(query.error().message, HasSubstr("exclude each other"));
}

plc_LogRecord record(std::uint64_t sequence, std::string_view text, bool goes_on = false) {
  LogRecord made{.sequence = sequence, .goes_on = goes_on ? 1U : 0U, .text = {}};
  made.text.assign(text);
  return sample_of(made);
}

TEST(LogLinesOfRecords, ArePutTogetherOverPages) {
  LogLines sut;
  EXPECT_TRUE(sut.add({record(1, "a", true)}).empty());
  const auto lines = sut.add({record(2, "b"), record(3, "c"), record(3, "again")});
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0].text, "ab");
  EXPECT_EQ(lines[0].missing, 0U);
  EXPECT_EQ(lines[1].text, "c");
}

TEST(LogLinesOfRecords, SayHowManyAreMissing) {
  LogLines sut;
  EXPECT_EQ(sut.add({record(500, "first seen")})[0].missing, 0U);
  EXPECT_TRUE(sut.add({record(501, "torn", true)}).empty());
  const auto lines = sut.add({record(510, "next")});
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0].missing, 8U);
  EXPECT_EQ(lines[0].text, "next");
  EXPECT_THAT(format_log_line(lines[0]), HasSubstr("(8 lines are missing here)\n"));
}

TEST(LogLinesOfRecords, HaveABound) {
  LogLines sut;
  std::size_t longest = 0;
  for (std::uint64_t number = 1; number < 2000; ++number) {
    for (const LogText& line : sut.add({record(number, std::string(kMaxLogText, 'x'), true)})) {
      longest = std::max(longest, line.text.size());
    }
  }
  EXPECT_GT(longest, 0U);
  EXPECT_LT(longest, 70'000U);
}

}  // namespace
}  // namespace plchost
