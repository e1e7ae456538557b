// The flight recorder: rings of entries, and the last losses.
#include "shm/pages/flight_page.hpp"

#include <array>
#include <atomic>
#include <cstring>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>

#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

TimePoint at(std::int64_t ns) {
  return TimePoint(Duration(ns));
}

class FlightRecorder : public testing::Test {
 protected:
  ~FlightRecorder() override { FlightPage::remove(pool(), "line1"); }
  [[nodiscard]] const std::string& pool() const { return name_.get(); }
  [[nodiscard]] FlightPage page(std::size_t tasks = 2) const {
    std::vector<FlightTask> made(tasks);
    for (std::size_t i = 0; i < tasks; ++i) made[i].name.assign("task" + std::to_string(i));
    return FlightPage::create(pool(), "line1", made).value();
  }
  [[nodiscard]] FlightPageReader reader() const { return FlightPageReader::open(pool(), "line1").value(); }
  UniquePoolName name_;
};

TEST_F(FlightRecorder, ReaderInAnotherMappingSeesTheEntriesInTheirOrder) {
  FlightPage sut = page();
  FlightRing ring = sut.ring(kFirstTaskRing + 1);
  ring.put(at(10), FlightKind::start, 3);
  ring.put(at(20), FlightKind::end);
  ring.put(at(21), FlightKind::moved, -7);
  const auto seen = reader().read(kFirstTaskRing + 1, 0);
  ASSERT_EQ(seen.entries.size(), 3U);
  EXPECT_EQ(seen.entries[0].time_ns, 10);
  EXPECT_EQ(seen.entries[0].kind, FlightKind::start);
  EXPECT_EQ(seen.entries[0].figure, 3);
  EXPECT_EQ(seen.entries[2].figure, -7);
  EXPECT_EQ(seen.next, 3U);
  EXPECT_TRUE(reader().read(kFirstTaskRing, 0).entries.empty()) << "that of another task";
  EXPECT_TRUE(reader().read(kFirstTaskRing + 1, seen.next).entries.empty());
}

TEST_F(FlightRecorder, FiguresBeyondTheirRangeAreCutAndNotTakenForOthers) {
  FlightPage sut = page();
  FlightRing ring = sut.ring(kControlRing);
  ring.put(at(1), FlightKind::work, INT64_MAX);
  ring.put(at(2), FlightKind::work, INT64_MIN);
  const auto seen = sut.read(kControlRing, 0);
  EXPECT_EQ(seen.entries[0].figure, FlightEntry::kMaxFigure);
  EXPECT_EQ(seen.entries[1].figure, -FlightEntry::kMaxFigure);
  EXPECT_EQ(seen.entries[1].kind, FlightKind::work);
}

TEST_F(FlightRecorder, AReaderThatIsOvertakenKnowsHowManyEntriesItHasMissed) {
  FlightPage sut = page();
  const std::size_t capacity = flight_capacity(2);
  FlightRing ring = sut.ring(kFirstTaskRing);
  for (std::size_t i = 0; i < capacity + 5; ++i) {
    ring.put(at(static_cast<std::int64_t>(i)), FlightKind::start);
  }
  const auto seen = sut.read(kFirstTaskRing, 2);
  ASSERT_FALSE(seen.entries.empty());
  EXPECT_EQ(seen.entries.size(), capacity - 1) << "the place of the next entry may be under way";
  EXPECT_EQ(static_cast<std::uint64_t>(seen.entries.front().time_ns), 2 + seen.skipped);
  EXPECT_EQ(static_cast<std::size_t>(seen.entries.back().time_ns), capacity + 4);
}

TEST_F(FlightRecorder, NoReaderTakesATornEntryForAWholeOne) {
  FlightPage sut = page();
  std::atomic<bool> ends{false};
  std::thread writer([&] {
    FlightRing ring = sut.ring(kFirstTaskRing);
    for (std::int64_t i = 1; !ends; ++i) ring.put(at(i), FlightKind::start, i);
  });
  const FlightPageReader other = reader();
  std::uint64_t seen = 0;
  for (int round = 0; round < 300 || seen == 0; ++round) {
    const auto read = other.read(kFirstTaskRing, seen);
    auto number = static_cast<std::int64_t>(seen + read.skipped);
    for (const FlightEntry& entry : read.entries) {
      ++number;
      ASSERT_EQ(entry.time_ns, number);
      ASSERT_EQ(entry.figure, number);
    }
    seen = read.next;
  }
  ends = true;
  writer.join();
}

TEST_F(FlightRecorder, AStrangerWhoWritesOverTheCountLeadsTheWriterNowhere) {
  FlightPage sut = page();
  FlightRing ring = sut.ring(kFirstTaskRing);
  ring.put(at(1), FlightKind::start);
  const MemoryFile memory =
      MemoryFile::open(flight_page_name(pool(), "line1"), 1, MemoryFile::Access::read_write).value();
  std::memset(memory.bytes().data(), 0xff, memory.bytes().size());
  ring.put(at(2), FlightKind::end);
  EXPECT_EQ(sut.read(kFirstTaskRing, 1).entries.back().time_ns, 2);
  EXPECT_FALSE(FlightPageReader::open(pool(), "line1")) << "no header is left";
  sut.keep();
  EXPECT_TRUE(FlightPageReader::open(pool(), "line1"));
}

TEST_F(FlightRecorder, APageThatDoesNotFitItsSizeIsRefused) {
  const FlightPage sut = page();
  const MemoryFile memory =
      MemoryFile::open(flight_page_name(pool(), "line1"), 1, MemoryFile::Access::read_write).value();
  auto& layout = *reinterpret_cast<FlightPageLayout*>(memory.bytes().data());
  for (const std::uint32_t count : {1U, 3U, 1024U, 0xffff'ffffU}) {
    layout.task_count = count;
    const auto refused = FlightPageReader::open(pool(), "line1");
    ASSERT_FALSE(refused) << count;
    EXPECT_THAT(refused.error().describe(), HasSubstr("does not fit"));
  }
  layout.version = 99;
  EXPECT_THAT(FlightPageReader::open(pool(), "line1").error().describe(), HasSubstr("version 99"));
}

TEST_F(FlightRecorder, PagesOfAllNumbersOfTasksHoldAtLeastTheLastSixtyFourEntries) {
  for (const std::size_t tasks : {0U, 1U, 30U, 31U, 200U, 1024U}) {
    FlightPage sut = page(tasks);
    FlightRing ring = sut.ring(kFirstTaskRing + tasks - 1);
    const auto put = static_cast<std::int64_t>(2 * flight_capacity(tasks) + 1);
    for (std::int64_t i = 1; i <= put; ++i) ring.put(at(i), FlightKind::start);
    auto seen = reader().read(kFirstTaskRing + tasks - 1, 0).entries;
    ASSERT_GE(seen.size(), 64U) << tasks;
    for (std::int64_t i = put; i > put - 64; --i, seen.pop_back()) ASSERT_EQ(seen.back().time_ns, i) << tasks;
  }
  EXPECT_EQ(flight_capacity(29), 4096U);
}

TEST_F(FlightRecorder, KeepsTheLastEightLossesOfATaskAndRoomForThoseOfOthers) {
  FlightPage sut = page(20);
  LossRecord loss;
  loss.cause = LossCause::long_cycle;
  for (int i = 0; i < 100; ++i) sut.add_loss(0, loss);
  const FlightPageReader seen = reader();
  std::set<std::uint64_t> numbers;
  for (std::size_t place = 0; place < kLossesKept; ++place) {
    if (const auto kept = seen.loss(place)) numbers.insert(kept->number);
  }
  EXPECT_EQ(numbers, (std::set<std::uint64_t>{93, 94, 95, 96, 97, 98, 99, 100}));
  for (std::size_t task = 1; task < 20; ++task) {
    for (int i = 0; i < 5; ++i) sut.add_loss(task, loss);
  }
  std::size_t count = 0;
  std::uint64_t least = UINT64_MAX;
  for (std::size_t place = 0; place < kLossesKept; ++place) {
    const auto kept = seen.loss(place);
    ASSERT_TRUE(kept);
    least = std::min(least, kept->number);
    ++count;
  }
  EXPECT_EQ(count, kLossesKept);
  EXPECT_EQ(least, 100U + 19 * 5 - kLossesKept + 1) << "the oldest have made room";
}

TEST_F(FlightRecorder, ALossThatAStrangerHasWrittenIsNotTold) {
  FlightPage sut = page();
  LossRecord loss;
  loss.task.assign("\x1b[2J");
  loss.own_ns = INT64_MAX;
  sut.add_loss(0, loss);
  EXPECT_FALSE(reader().loss(0)) << "its parts have no sum";
  loss.own_ns = 1;
  sut.add_loss(0, loss);
  EXPECT_EQ(reader().loss(1)->task.view(), "?[2J");
}

}  // namespace
}  // namespace plchost
