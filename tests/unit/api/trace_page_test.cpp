// The page of a flight recorder that answers a query: its entries, its bounds, and how it travels.
#include "api/dds/trace_page.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "shm/pages/flight_page.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using testing::SizeIs;

constexpr std::size_t kPageIsFull = kPageTraceEntries;

TimePoint time_of_ns(std::int64_t ns) {
  return TimePoint(Duration(ns));
}

class TraceOfARecorder : public testing::Test {
 protected:
  ~TraceOfARecorder() override { FlightPage::remove(pool(), "line1"); }
  [[nodiscard]] const std::string& pool() const { return name_; }
  [[nodiscard]] FlightPage page(std::size_t tasks = 2) const {
    std::vector<FlightTask> made(tasks);
    for (std::size_t i = 0; i < tasks; ++i) {
      made[i] = {.name = {}, .iec_priority = static_cast<std::int32_t>(i), .event_mark = 7};
      made[i].name.assign("task" + std::to_string(i));
    }
    return FlightPage::create(pool(), "line1", made).value();
  }
  [[nodiscard]] TraceListing after(std::uint64_t time) const {
    return look_at_trace(pool(), "line1", {.after = time}).value();
  }
  std::string name_ = own_name("trace");
};

std::size_t count_of_entries(const TraceListing& listing) {
  std::size_t sum = 0;
  for (const TraceRing& ring : listing.rings) sum += ring.entries.size();
  return sum;
}

TEST_F(TraceOfARecorder, NamesTheTasksAlsoThoseThatHaveDoneNothing) {
  FlightPage sut = page();
  sut.ring(kFirstTaskRing + 1).put(time_of_ns(10), FlightKind::start, 3);
  const TraceListing listing = after(0);
  ASSERT_THAT(listing.rings, SizeIs(kFirstTaskRing + 2));
  EXPECT_EQ(listing.rings[kControlRing].task, "");
  const TraceRing& ring = listing.rings[kFirstTaskRing + 1];
  EXPECT_EQ(ring.ring, kFirstTaskRing + 1);
  EXPECT_EQ(ring.task, "task1");
  EXPECT_EQ(ring.iec_priority, 1);
  EXPECT_EQ(ring.event_mark, 7U);
  ASSERT_THAT(ring.entries, SizeIs(1));
  EXPECT_EQ(ring.entries[0].figure, 3);
  EXPECT_TRUE(listing.complete);
  EXPECT_EQ(listing.next_after, 10U);
  EXPECT_GT(listing.pid, 0);
  EXPECT_GT(listing.time_monotonic_ns, 0);
  EXPECT_GT(listing.time_unix_ns, 0);
}

TEST_F(TraceOfARecorder, HasTheEntriesBehindThatTimeWithTheirNumbers) {
  FlightPage sut = page();
  FlightRing ring = sut.ring(kFirstTaskRing);
  for (std::int64_t i = 0; i < 2000; ++i) ring.put(time_of_ns(i * 10), FlightKind::start, i);
  const TraceListing some = after(100);
  EXPECT_EQ(some.rings[kFirstTaskRing].first, 11U);
  EXPECT_EQ(some.rings[kFirstTaskRing].entries.front().figure, 11);
  EXPECT_THAT(some.rings[kFirstTaskRing].entries, SizeIs(2000 - 11));
  const TraceListing last = after(19'985);
  EXPECT_EQ(last.rings[kFirstTaskRing].first, 1999U);
  EXPECT_THAT(last.rings[kFirstTaskRing].entries, SizeIs(1));
  const TraceListing none = after(kAfterAllEntries);
  EXPECT_EQ(count_of_entries(none), 0U);
  EXPECT_EQ(none.rings[kFirstTaskRing].first, 2000U);
  EXPECT_GT(none.pid, 0) << "it still says whose recorder it is";
  EXPECT_EQ(count_of_entries(after(~std::uint64_t{0})), 0U);
}

TEST_F(TraceOfARecorder, AnEntryThatComesWithAnEarlierTimeIsNotLeftOut) {
  FlightPage sut = page();
  FlightRing ring = sut.ring(kControlRing);
  ring.put(time_of_ns(100), FlightKind::held, 1);
  ring.put(time_of_ns(80), FlightKind::fault, 2);
  EXPECT_THAT(after(90).rings[kControlRing].entries, SizeIs(0)) << "it was seen with the page before";
  EXPECT_THAT(after(70).rings[kControlRing].entries, SizeIs(2));
}

TEST_F(TraceOfARecorder, AFullRingThatWasWrittenOverBeginsWithWhatIsWhole) {
  FlightPage sut = page();
  const auto capacity = static_cast<std::int64_t>(flight_capacity(2));
  FlightRing ring = sut.ring(kFirstTaskRing);
  for (std::int64_t i = 1; i <= 3 * capacity; ++i) ring.put(time_of_ns(i), FlightKind::start, i);
  const TraceListing listing = after(1);
  const TraceRing& told = listing.rings[kFirstTaskRing];
  ASSERT_FALSE(told.entries.empty());
  EXPECT_EQ(told.first + 1, static_cast<std::uint64_t>(told.entries.front().figure));
  EXPECT_EQ(told.entries.back().figure, 3 * capacity);
  EXPECT_EQ(told.entries.front().figure, 2 * capacity + 2) << "the place of the next one may be under way";
}

TEST_F(TraceOfARecorder, PagesHaveABoundAndTogetherEachEntryOnce) {
  FlightPage sut = page(3);
  std::size_t put = 0;
  for (std::size_t task = 0; task < 3; ++task) {
    FlightRing ring = sut.ring(kFirstTaskRing + task);
    // As a task does: some entries have one time.
    for (std::int64_t i = 1; i <= 3000; ++i, ++put) ring.put(time_of_ns(i / 2 * 2 + 1), FlightKind::start, i);
  }
  std::vector<std::uint64_t> next(kFirstTaskRing + 3);
  std::size_t pages = 0;
  std::uint64_t behind = 0;
  for (bool goes_on = true; goes_on && pages < 10; ++pages) {
    const TraceListing listing = after(behind);
    EXPECT_LE(count_of_entries(listing), kPageIsFull);
    for (const TraceRing& ring : listing.rings) {
      if (ring.entries.empty()) continue;
      EXPECT_EQ(ring.first, next[ring.ring]);
      next[ring.ring] = ring.first + ring.entries.size();
    }
    goes_on = !listing.complete;
    EXPECT_GT(listing.next_after, behind);
    behind = listing.next_after;
  }
  EXPECT_EQ(pages, 3U);
  EXPECT_EQ(next[kFirstTaskRing] + next[kFirstTaskRing + 1] + next[kFirstTaskRing + 2], put);
}

TEST_F(TraceOfARecorder, OfAnInstanceWithoutOneHasTheClocksOnly) {
  const TraceListing listing = after(5);
  EXPECT_EQ(listing.pid, 0);
  EXPECT_TRUE(listing.rings.empty());
  EXPECT_TRUE(listing.complete);
  EXPECT_EQ(listing.next_after, 5U);
  EXPECT_GT(listing.time_monotonic_ns, 0);
}

TraceListing of_one_ring(const std::vector<std::int64_t>& times) {
  TraceListing listing;
  TraceRing& ring = listing.rings.emplace_back();
  for (const std::int64_t time : times)
    ring.entries.push_back({.time_ns = time, .kind = FlightKind::start, .figure = 0});
  return listing;
}

TEST(TracePageCut, GoesOnAlsoWhenMoreThanAPageIsOfOneTime) {
  TraceListing listing = of_one_ring(std::vector<std::int64_t>(kPageIsFull + 10, 50));
  cut_to_page(listing, 49);
  EXPECT_FALSE(listing.complete);
  EXPECT_EQ(listing.next_after, 50U);
  EXPECT_EQ(count_of_entries(listing), kPageIsFull);
}

TEST(TracePageCut, IsNotMisledByTimesOfAStranger) {
  std::vector<std::int64_t> times(kPageIsFull + 10, INT64_MIN);
  times.back() = INT64_MAX;
  TraceListing listing = of_one_ring(times);
  cut_to_page(listing, 0);
  EXPECT_LE(count_of_entries(listing), kPageIsFull);
}

TEST(TracePage, TravelsAsItIs) {
  TraceListing listing{
      .pid = 12, .time_monotonic_ns = 5, .time_unix_ns = 6, .complete = false, .next_after = 9};
  listing.rings.push_back({.ring = 3,
                           .task = "Fill",
                           .iec_priority = 2,
                           .event_mark = 77,
                           .first = 40,
                           .entries = {{.time_ns = 1, .kind = FlightKind::start, .figure = -2},
                                       {.time_ns = 3, .kind = FlightKind::end, .figure = 4}}});
  listing.rings.push_back({.ring = 4, .task = "Cap", .entries = {{.time_ns = 8, .kind = FlightKind::lost}}});
  TracePageSample sample(listing);
  const TraceListing back = listing_of(sample.page());
  EXPECT_EQ(back.pid, 12);
  EXPECT_EQ(back.time_monotonic_ns, 5);
  EXPECT_EQ(back.time_unix_ns, 6);
  EXPECT_FALSE(back.complete);
  EXPECT_EQ(back.next_after, 9U);
  ASSERT_THAT(back.rings, SizeIs(2));
  EXPECT_EQ(back.rings[0].task, "Fill");
  EXPECT_EQ(back.rings[0].first, 40U);
  EXPECT_EQ(back.rings[0].event_mark, 77U);
  EXPECT_EQ(back.rings[0].entries[0].figure, -2);
  ASSERT_THAT(back.rings[1].entries, SizeIs(1));
  EXPECT_EQ(back.rings[1].entries[0].kind, FlightKind::lost);
  EXPECT_EQ(trace_query_of(part_of(TraceQuery{.after = 12})).after, 12U);
}

TEST(TracePage, OfAStrangerWithCountsThatDoNotFitEndsThere) {
  TraceListing listing;
  listing.rings.push_back(
      {.ring = 3, .task = "Fill", .entries = {{.time_ns = 1, .kind = FlightKind::start}}});
  TracePageSample sample(listing);
  plc_TracePage& page = sample.page();
  page.rings._buffer[0].entry_count = 2;
  EXPECT_TRUE(listing_of(page).rings.empty());
  page.rings._buffer[0].entry_count = 1;
  page.entries._buffer[0].kind = 256 + 1;
  ASSERT_THAT(listing_of(page).rings, SizeIs(1));
  EXPECT_EQ(listing_of(page).rings[0].entries[0].kind, FlightKind::none);
}

}  // namespace
}  // namespace plchost
