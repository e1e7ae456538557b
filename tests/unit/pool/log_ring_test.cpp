#include "shm/pages/log_ring.hpp"

#include <cstring>
#include <random>
#include <string>

#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/guard/memory_guard.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

class Log : public testing::Test {
 protected:
  ~Log() override { LogRing::remove(pool(), "line1"); }
  [[nodiscard]] const std::string& pool() const { return name_.get(); }
  LogRing open() { return LogRing::open(pool(), "line1").value(); }
  LogRingReader reader() { return LogRingReader::open(pool(), "line1").value(); }
  [[nodiscard]] MemoryFile map() const {
    return MemoryFile::open(log_ring_name(pool(), "line1"), 1, MemoryFile::Access::read_write).value();
  }
  static void say(LogRing& ring, std::string_view text) {
    ring.add(
        {.time_unix_ns = 5, .pid = 7, .level = LogLevel::warning, .source = LogSource::output, .text = text});
  }
  static std::vector<std::string> texts(const LogSlice& slice) {
    std::vector<std::string> texts;
    for (const LogRecord& record : slice.records) texts.emplace_back(record.text.view());
    return texts;
  }
  UniquePoolName name_;
};

TEST_F(Log, TellsWhatWasSaidInOrder) {
  EXPECT_EQ(LogRingReader::open(pool(), "line1").error().code, ErrorCode::not_found);
  LogRing ring = open();
  EXPECT_TRUE(reader().read(0, 10).records.empty());
  say(ring, "first");
  say(ring, "second");
  const LogSlice slice = reader().read(0, 10);
  EXPECT_EQ(texts(slice), (std::vector<std::string>{"first", "second"}));
  EXPECT_EQ(slice.last, 2U);
  EXPECT_EQ(slice.records[0].sequence, 1U);
  EXPECT_EQ(slice.records[0].time_unix_ns, 5);
  EXPECT_EQ(slice.records[0].pid, 7);
  EXPECT_EQ(slice.records[0].level, LogLevel::warning);
  EXPECT_EQ(slice.records[0].source, LogSource::output);
  EXPECT_EQ(texts(reader().read(1, 10)), std::vector<std::string>{"second"});
  EXPECT_EQ(texts(reader().read(0, 1)), std::vector<std::string>{"first"});
  EXPECT_TRUE(reader().read(2, 10).records.empty());
  EXPECT_TRUE(reader().read(99, 10).records.empty()) << "of an earlier numbering";
  EXPECT_EQ(texts(reader().newest(1, 10)), std::vector<std::string>{"second"});
  EXPECT_EQ(texts(reader().newest(10, 10)).size(), 2U);
}

TEST_F(Log, KeepsTheNewestAndTellsByTheirNumbersWhatIsMissing) {
  LogRing ring = open();
  constexpr std::size_t kSaid = 3 * kLogRecordsKept + 5;
  for (std::size_t i = 1; i <= kSaid; ++i) say(ring, std::to_string(i));
  const LogSlice slice = reader().read(0, 2 * kLogRecordsKept);
  ASSERT_EQ(slice.records.size(), kLogRecordsKept);
  EXPECT_EQ(slice.records.front().sequence, kSaid - kLogRecordsKept + 1);
  EXPECT_EQ(slice.records.front().text.view(), std::to_string(kSaid - kLogRecordsKept + 1));
  EXPECT_EQ(slice.records.back().text.view(), std::to_string(kSaid));
}

TEST_F(Log, WritesALongLineInParts) {
  LogRing ring = open();
  // Letters of three bytes: none is torn.
  std::string line;
  for (int i = 0; i < 100; ++i) line += "\u20ac";
  say(ring, line);
  say(ring, "");
  const LogSlice slice = reader().read(0, 10);
  ASSERT_EQ(slice.records.size(), 3U);
  EXPECT_EQ(slice.records[0].goes_on, 1U);
  EXPECT_EQ(slice.records[1].goes_on, 0U);
  EXPECT_EQ(std::string(slice.records[0].text.view()) + std::string(slice.records[1].text.view()), line);
}

TEST_F(Log, HoldsNothingThatDrivesATerminal) {
  LogRing ring = open();
  say(ring, std::string_view("a\x1b[2J\tb\0c\xff", 10));
  EXPECT_EQ(texts(reader().read(0, 1)), std::vector<std::string>{"a?[2J b?c?"});
}

TEST_F(Log, GoesOnAfterAWriterThatWasKilled) {
  for (int round = 0; round < 20; ++round) {
    const pid_t child = ::fork();
    if (child == 0) {
      LogRing ring = open();
      for (;;) say(ring, "said by a process that is killed");
    }
    ::usleep(2000);
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
  }
  LogRing ring = open();
  const std::uint64_t last = reader().read(0, 1).last;
  say(ring, "the next");
  const LogSlice slice = reader().read(0, kLogRecordsKept);
  EXPECT_EQ(slice.last, last + 1);
  ASSERT_FALSE(slice.records.empty());
  EXPECT_EQ(slice.records.back().text.view(), "the next");
  for (std::size_t i = 1; i < slice.records.size(); ++i) {
    ASSERT_EQ(slice.records[i].sequence, slice.records[i - 1].sequence + 1)
        << "nothing torn, nothing left out";
  }
}

TEST_F(Log, AStrangerWhoScribblesHarmsNobody) {
  LogRing ring = open();
  for (int i = 0; i < 100; ++i) say(ring, "line " + std::to_string(i));
  const LogRingReader sut = reader();
  const MemoryFile memory = map();
  std::mt19937 random(1);  // NOLINT(cert-msc51-cpp): the same each time
  for (int round = 0; round < 3000; ++round) {
    const std::size_t at = random() % 30'000;
    memory.bytes()[at] = static_cast<std::byte>(random() % 256);
    const LogSlice slice = sut.read(random() % 200, kLogRecordsKept);
    EXPECT_LE(slice.records.size(), kLogRecordsKept);
    for (const LogRecord& record : slice.records) ASSERT_TRUE(is_printable_utf8(record.text.view())) << at;
  }
  say(ring, "after all that");
  EXPECT_EQ(texts(reader().newest(1, 1)), std::vector<std::string>{"after all that"})
      << "the header is mended";
}

TEST_F(Log, ANumberThatNobodyCanHaveReachedIsNotGoneOnWith) {
  {
    const LogRing ring = open();
  }
  const MemoryFile memory = map();
  auto& layout = *reinterpret_cast<LogRingLayout*>(memory.bytes().data());
  layout.last.store(~std::uint64_t{0});
  EXPECT_TRUE(reader().read(0, 10).records.empty());
  LogRing ring = open();
  say(ring, "x");
  EXPECT_EQ(reader().read(0, 10).last, 1U);
}

TEST_F(Log, WhoseMemoryWasCutShortIsMadeAnew) {
  MemoryGuard::watch_process();
  LogRing ring = open();
  say(ring, "before");
  ASSERT_EQ(::truncate(MemoryFile::path(log_ring_name(pool(), "line1")).c_str(), 0), 0);
  say(ring, "finds it out");
  say(ring, "after");
  EXPECT_EQ(texts(reader().newest(1, 1)), std::vector<std::string>{"after"});
}

TEST_F(Log, WhatIsNoneIsReplaced) {
  (void)MemoryFile::replace(log_ring_name(pool(), "line1"), 4096);
  EXPECT_EQ(LogRingReader::open(pool(), "line1").error().code, ErrorCode::corrupt);
  LogRing ring = open();
  say(ring, "x");
  EXPECT_EQ(reader().read(0, 10).records.size(), 1U);
}

}  // namespace
}  // namespace plchost
