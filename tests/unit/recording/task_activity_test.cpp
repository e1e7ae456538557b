// The entries of a task as cycles.
#include "api/recording/task_activity.hpp"

#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "shm/pages/flight_page.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

constexpr std::int64_t kActivityBegin = 100;
constexpr std::int64_t kActivityEnd = 1000;

TaskActivity activity_in(const std::vector<FlightEntry>& entries,
                         const std::vector<RecordedRing::Gap>& gaps = {},
                         const std::vector<RecordedFault>& faults = {}) {
  RecordedRing ring;
  ring.ring = kFirstTaskRing;
  ring.task = "Fill";
  ring.entries = entries;
  ring.gaps = gaps;
  return activity_of(ring, kActivityBegin, kActivityEnd, faults);
}

/// "200-300", and why it is not whole.
std::vector<std::string> shown_cycles(const TaskActivity& activity) {
  std::vector<std::string> lines;
  for (const RecordedCycle& cycle : activity.cycles) {
    const std::string_view cut = to_string(cycle.cut);
    lines.push_back(fmt::format("{}-{}{}{}", cycle.from, cycle.to, cut.empty() ? "" : " ", cut));
  }
  return lines;
}

TEST(ActivityOfATask, HasCyclesWithWhatWasToldOfThem) {
  const TaskActivity sut = activity_in({{200, FlightKind::lost, 3},
                                        {200, FlightKind::taken, 0x1'0000'0011},
                                        {200, FlightKind::start, 40},
                                        {250, FlightKind::posted, 9},
                                        {300, FlightKind::end, 25},
                                        {300, FlightKind::moved, -5},
                                        {360, FlightKind::work, 60},
                                        {400, FlightKind::start, 1},
                                        {450, FlightKind::end, 0}});
  ASSERT_THAT(shown_cycles(sut), ElementsAre("200-300", "400-450"));
  EXPECT_EQ(sut.cycles[0].lost, 3);
  EXPECT_EQ(sut.cycles[0].post, 0x11U);
  EXPECT_EQ(sut.cycles[0].latency_ns, 40);
  EXPECT_EQ(sut.cycles[0].spun_ns, 25);
  EXPECT_EQ(sut.cycles[1].lost, 0);
  EXPECT_FALSE(sut.cycles[1].post);
  ASSERT_THAT(sut.work, SizeIs(1));
  EXPECT_EQ(sut.work[0].from, 300);
  EXPECT_EQ(sut.work[0].to, 360);
  ASSERT_THAT(sut.moments, SizeIs(3));
  EXPECT_EQ(sut.moments[1].kind, FlightKind::posted);
}

TEST(ActivityOfATask, ThatBeganBeforeTheRecordingBeginsWithIt) {
  for (const FlightKind first :
       {FlightKind::end, FlightKind::posted, FlightKind::halted, FlightKind::resumed}) {
    const TaskActivity sut = activity_in({{150, first, 0}, {160, FlightKind::end, 0}});
    EXPECT_EQ(shown_cycles(sut).front().substr(0, 35),
              fmt::format("100-{} began before the recording", first == FlightKind::end ? 150 : 160));
  }
  EXPECT_THAT(shown_cycles(activity_in({{150, FlightKind::moved, 1}})), IsEmpty());
}

TEST(ActivityOfATask, ThatGoesOnBehindTheRecordingEndsWithIt) {
  EXPECT_THAT(shown_cycles(activity_in({{150, FlightKind::start, 0}})),
              ElementsAre("150-1000 goes on behind the recording"));
}

TEST(ActivityOfATask, InExceptionEndsWithTheFault) {
  const std::vector<FlightEntry> entries{{150, FlightKind::start, 0}};
  EXPECT_THAT(shown_cycles(activity_in(entries, {}, {{kFirstTaskRing, 400}, {kFirstTaskRing + 1, 300}})),
              ElementsAre("150-400 exception"));
  EXPECT_THAT(shown_cycles(activity_in(entries, {}, {{kFirstTaskRing, 140}})),
              ElementsAre("150-1000 goes on behind the recording"));
}

TEST(ActivityOfATask, EndsWithTheLastEntryBeforeOthersAreMissing) {
  const TaskActivity sut = activity_in({{150, FlightKind::start, 0},
                                        {160, FlightKind::posted, 0},
                                        {500, FlightKind::end, 0},
                                        {600, FlightKind::start, 0},
                                        {700, FlightKind::end, 0}},
                                       {{.before = 2, .missing = 12, .process = 0}});
  EXPECT_THAT(shown_cycles(sut), ElementsAre("150-160 its end is missing", "600-700"));
  ASSERT_THAT(sut.missing, SizeIs(1));
  EXPECT_EQ(sut.missing[0].count, 12U);
  EXPECT_EQ(sut.missing[0].time_ns, 500);
}

TEST(ActivityOfATask, EndsWithItsProcess) {
  EXPECT_THAT(shown_cycles(activity_in(
                  {{150, FlightKind::start, 0}, {300, FlightKind::start, 0}, {310, FlightKind::end, 0}},
                  {{.before = 1, .missing = 0, .process = 9}})),
              ElementsAre("150-150 the process has ended", "300-310"));
  EXPECT_THAT(
      shown_cycles(activity_in({{150, FlightKind::start, 0}}, {{.before = 1, .missing = 0, .process = 9}})),
      ElementsAre("150-150 the process has ended"));
}

TEST(ActivityOfATask, ThatADebuggerHoldsIsHaltedWithinItsCycle) {
  const TaskActivity sut = activity_in({{200, FlightKind::start, 0},
                                        {210, FlightKind::halted, 0},
                                        {290, FlightKind::resumed, 0},
                                        {300, FlightKind::end, 0},
                                        {400, FlightKind::start, 0},
                                        {410, FlightKind::halted, 0}});
  ASSERT_THAT(sut.halts, SizeIs(2));
  EXPECT_EQ(sut.halts[0].from, 210);
  EXPECT_EQ(sut.halts[0].to, 290);
  EXPECT_EQ(sut.halts[1].to, kActivityEnd);
}

TEST(ActivityOfATask, OfAStrangerStaysInTheOrderOfTime) {
  std::mt19937_64 random(3);
  for (int round = 0; round < 300; ++round) {
    std::vector<FlightEntry> entries;
    for (int i = 0; i < 30; ++i) {
      entries.push_back({.time_ns = kActivityBegin + static_cast<std::int64_t>(random() % 900),
                         .kind = static_cast<FlightKind>(random() % 25),
                         .figure = static_cast<std::int64_t>(random())});
    }
    const TaskActivity sut =
        activity_in(entries, {{.before = 10, .missing = 5, .process = 0}}, {{kFirstTaskRing, 500}});
    std::int64_t last = kActivityBegin;
    auto work = sut.work.begin();
    for (const RecordedCycle& cycle : sut.cycles) {
      for (; work != sut.work.end() && work->to <= cycle.from; ++work) {
        ASSERT_GE(work->from, last);
        ASSERT_GE(work->to, work->from);
        last = work->to;
      }
      ASSERT_GE(cycle.from, last);
      ASSERT_GE(cycle.to, cycle.from);
      last = cycle.to;
    }
    for (const TaskActivity::Piece& halt : sut.halts) {
      const auto within = [&](const RecordedCycle& cycle) {
        return cycle.from <= halt.from && halt.to <= cycle.to;
      };
      ASSERT_TRUE(std::ranges::any_of(sut.cycles, within));
    }
  }
}

}  // namespace
}  // namespace plchost
