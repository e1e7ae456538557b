#include "manager/supervisor/output_lines.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "shm/base/time.hpp"
#include "shm/log/log_line.hpp"

namespace plchost {
namespace {

struct Said {
  LogEntry entry;
  std::string text;
};

class Output : public testing::Test {
 protected:
  void add(std::string_view bytes) {
    sut_.add(bytes, 7, kNow, [this](const LogEntry& entry) { keep(entry); });
  }
  void end() {
    sut_.end(7, kNow, [this](const LogEntry& entry) { keep(entry); });
  }
  std::vector<std::string> texts() {
    std::vector<std::string> texts;
    for (const Said& one : said_) texts.push_back(one.text);
    said_.clear();
    return texts;
  }
  static constexpr std::int64_t kNow = 1'800'000'000'000'000'000;
  std::vector<Said> said_;

 private:
  void keep(const LogEntry& entry) { said_.push_back({entry, std::string(entry.text)}); }
  OutputLines sut_;
};

using Texts = std::vector<std::string>;

TEST_F(Output, BecomesLinesWhereverItWasTorn) {
  add("one\ntw");
  EXPECT_EQ(texts(), Texts{"one"});
  add("o\r\n\n\nthree");
  EXPECT_EQ(texts(), Texts{"two"}) << "lines that say nothing are left out";
  end();
  EXPECT_EQ(texts(), Texts{"three"});
  end();
  EXPECT_EQ(texts(), Texts{});
}

TEST_F(Output, OfALineWithoutEndIsHandedOnInParts) {
  const std::string endless(OutputLines::kMaxLine + 10, 'x');
  add(endless);
  EXPECT_EQ(texts(), Texts{std::string(OutputLines::kMaxLine, 'x')});
  add("\n");
  EXPECT_EQ(texts(), Texts{std::string(10, 'x')});
  add(std::string(OutputLines::kMaxLine, 'y') + "\nz\n");
  EXPECT_EQ(texts(), (Texts{std::string(OutputLines::kMaxLine, 'y'), "z"}));
}

TEST_F(Output, OfTheRuntimeSaysHowBadItIsAndWhoSaidIt) {
  add("2027-01-15 08:00:00.250 warning plc-instance/line1: watchdog: late: again\n"
      "2027-01-15 08:00:00.250 error plc-instance/line1: application: valve 7 is stuck\n"
      "2027-01-15 08:00:00.250 error other: text\n"
      "valve 8 is stuck\n");
  ASSERT_EQ(said_.size(), 4U);
  EXPECT_EQ(said_[0].text, "watchdog: late: again");
  EXPECT_EQ(said_[0].entry.level, LogLevel::warning);
  EXPECT_EQ(said_[0].entry.source, LogSource::runtime);
  EXPECT_EQ(said_[0].entry.pid, 7);
  EXPECT_EQ(said_[1].text, "valve 7 is stuck");
  EXPECT_EQ(said_[1].entry.source, LogSource::application);
  EXPECT_EQ(said_[1].entry.level, LogLevel::error);
  EXPECT_EQ(said_[2].text, "2027-01-15 08:00:00.250 error other: text");
  EXPECT_EQ(said_[2].entry.source, LogSource::output);
  EXPECT_EQ(said_[3].entry.time_unix_ns, kNow);
}

TEST_F(Output, WithoutAnEndDoesNotHideWhatTheRuntimeSaysNext) {
  add("pressure: 2027-01-15 08:00:00.250 error plc-instance/line1: exception: SIGSEGV\n");
  ASSERT_EQ(said_.size(), 2U);
  EXPECT_EQ(said_[0].text, "pressure: ");
  EXPECT_EQ(said_[0].entry.source, LogSource::output);
  EXPECT_EQ(said_[1].text, "exception: SIGSEGV");
  EXPECT_EQ(said_[1].entry.level, LogLevel::error);
  said_.clear();
  add("plc-instance/ is no log line\nnor is this: info plc-instance/line1: x\n");
  EXPECT_EQ(texts(), (Texts{"plc-instance/ is no log line", "nor is this: info plc-instance/line1: x"}));
}

TEST(LogLineTest, IsReadAsItIsWritten) {
  const auto line = parse_log_line("2026-11-22 18:33:01.123 info plc-instance/line1: a: b");
  ASSERT_TRUE(line);
  EXPECT_EQ(line->program, "plc-instance/line1");
  EXPECT_EQ(line->text, "a: b");
  EXPECT_EQ(line->level, LogLevel::info);
  EXPECT_EQ(line->time_unix_ns % 1'000'000'000, 123'000'000);
  for (const char* const other :
       {"", "x", "2026-11-22 18:33:01.123 ", "2026-11-22 18:33:01.123 info", "2026-11-22 18:33:01.123 info x",
        "2026-11-22 18:33:01.123 bad x: y", "2026-11-22T18:33:01.123 info x: y",
        "2026-11-2a 18:33:01.123 info x: y", "2026-11-22 18:33:01.123 info : y"}) {
    EXPECT_FALSE(parse_log_line(other)) << other;
  }
}

TEST_F(Output, ThatLiesAboutItsTimeIsOfNow) {
  add("1999-01-01 00:00:00.000 info plc-instance/line1: old\n");
  ASSERT_EQ(said_.size(), 1U);
  EXPECT_EQ(said_[0].entry.time_unix_ns, kNow);
}

}  // namespace
}  // namespace plchost
