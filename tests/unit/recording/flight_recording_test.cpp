// Pages of a flight recorder that overlap, put together.
#include "api/recording/flight_recording.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "shm/pages/flight_page.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

constexpr std::uint32_t kTaskRing = kFirstTaskRing;

/// A page made at `now`, with starts at these times of one task.
TraceListing page(std::int64_t now, std::uint64_t first, const std::vector<std::int64_t>& times,
                  std::int32_t pid = 7, const std::string& task = "Fill", std::uint32_t ring = kTaskRing) {
  TraceListing listing{.pid = pid, .time_monotonic_ns = now};
  TraceRing& told = listing.rings.emplace_back();
  told.ring = ring;
  told.task = task;
  told.first = first;
  for (const std::int64_t time : times) told.entries.push_back({.time_ns = time, .kind = FlightKind::start});
  return listing;
}

std::vector<std::int64_t> recorded_times(const FlightRecording& recording) {
  std::vector<std::int64_t> times;
  for (const RecordedRing& ring : recording.rings())
    for (const FlightEntry& entry : ring.entries) times.push_back(entry.time_ns);
  return times;
}

class RecordedPages : public testing::Test {
 protected:
  RecordedPages() { sut_.add(page(100, 5, {})); }
  FlightRecording sut_{"line1", -1};
};

TEST_F(RecordedPages, HaveEachEntryOnce) {
  sut_.add(page(200, 5, {110, 120}));
  sut_.add(page(300, 6, {120, 210, 220}));
  sut_.add(page(310, 6, {120, 210, 220}));
  sut_.add(page(320, 9, {}));
  EXPECT_THAT(recorded_times(sut_), ElementsAre(110, 120, 210, 220));
  EXPECT_EQ(sut_.missing(), 0U);
  EXPECT_EQ(sut_.begin_ns(), 100);
  EXPECT_EQ(sut_.end_ns(), 320);
  EXPECT_EQ(sut_.entries(), 4U);
  EXPECT_THAT(sut_.rings()[0].gaps, IsEmpty());
}

TEST_F(RecordedPages, TellOfEntriesThatWereWrittenOver) {
  sut_.add(page(200, 8, {150}));
  sut_.add(page(300, 10, {250}));
  EXPECT_EQ(sut_.missing(), 3U + 1U);
  ASSERT_THAT(sut_.rings()[0].gaps, SizeIs(2));
  EXPECT_EQ(sut_.rings()[0].gaps[0].before, 0U);
  EXPECT_EQ(sut_.rings()[0].gaps[0].missing, 3U);
  EXPECT_EQ(sut_.rings()[0].gaps[1].before, 1U);
}

TEST_F(RecordedPages, OfANewProcessGoOnWithTheTaskOfThatName) {
  sut_.add(page(200, 5, {150}));
  sut_.add(page(300, 0, {250, 260}, 8, "Fill", kTaskRing + 1));
  sut_.add(page(400, 2, {}, 0));
  sut_.add(page(500, 2, {450}, 8, "Fill", kTaskRing + 1));
  ASSERT_THAT(sut_.rings(), SizeIs(1));
  EXPECT_THAT(recorded_times(sut_), ElementsAre(150, 250, 260, 450));
  EXPECT_EQ(sut_.missing(), 0U);
  EXPECT_EQ(sut_.rings()[0].ring, kTaskRing + 1);
  ASSERT_THAT(sut_.rings()[0].gaps, SizeIs(1));
  EXPECT_EQ(sut_.rings()[0].gaps[0].process, 8);
}

TEST_F(RecordedPages, OfAnInstanceThatStartsMeanwhileBeginWithItsFirstEntry) {
  FlightRecording sut("line2", -1);
  sut.add(TraceListing{.pid = 0, .time_monotonic_ns = 100});
  sut.add(page(200, 0, {150, 160}));
  EXPECT_THAT(recorded_times(sut), ElementsAre(150, 160));
  EXPECT_EQ(sut.missing(), 0U);
}

TEST_F(RecordedPages, OfAStrangerAreLeftOutAndCounted) {
  sut_.add(page(200, 5, {-1, 90, 110, 201, INT64_MAX, INT64_MIN}));
  EXPECT_THAT(recorded_times(sut_), ElementsAre(110));
  EXPECT_EQ(sut_.damaged(), 5U);
  TraceListing twice = page(300, 11, {250});
  twice.rings.push_back(twice.rings[0]);
  twice.rings.push_back(twice.rings[0]);
  twice.rings[2].ring = UINT32_MAX;
  twice.rings[2].task = "Other";
  sut_.add(twice);
  EXPECT_THAT(recorded_times(sut_), ElementsAre(110, 250));
  EXPECT_EQ(sut_.damaged(), 7U);
  sut_.add(page(400, UINT64_MAX, {350, 360}));
  EXPECT_EQ(sut_.damaged(), 9U) << "no ring counts so far";
  TraceListing none = page(500, 12, {450});
  none.rings[0].entries[0].kind = FlightKind::none;
  sut_.add(none);
  EXPECT_EQ(sut_.damaged(), 10U);
  for (std::int32_t pid = 100; pid < 2000; ++pid) sut_.add(page(600, 0, {}, pid, std::to_string(pid)));
  EXPECT_LE(sut_.rings().size(), 4U * 1027U);
  EXPECT_LE(sut_.rings()[0].gaps.size(), 2U) << "an end of a process is told once until the next entry";
}

TEST_F(RecordedPages, HaveTasksWithTextsThatCanBeShown) {
  sut_.add(page(200, 5, {150}, 7, "a\x1b[2J\xff", kTaskRing + 1));
  sut_.add(page(300, 0, {}, 7, "", kTaskRing + 2));
  EXPECT_EQ(sut_.rings()[1].task, "a?[2J?");
  EXPECT_EQ(sut_.rings()[2].task, "task 2");
}

}  // namespace
}  // namespace plchost
