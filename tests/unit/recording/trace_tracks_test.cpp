// The tracks of a trace, as protoc reads them.
#include "api/recording/trace_tracks.hpp"

#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "shm/base/fault_record.hpp"
#include "shm/pages/flight_page.hpp"
#include "tests/support/decoded_trace.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using testing::UnorderedElementsAre;

constexpr std::int64_t kTraceBegin = 1000;
constexpr TraceClocks kTraceClocks{.boot_ns = 5000, .monotonic_ns = 5000, .unix_ns = 70'000};

TraceRing told_ring(std::uint32_t ring, std::string name, std::vector<FlightEntry> entries,
                    std::uint32_t mark = 0) {
  return {.ring = ring,
          .task = ring < kFirstTaskRing ? "" : std::move(name),
          .iec_priority = static_cast<std::int32_t>(ring),
          .event_mark = mark,
          .first = 0,
          .entries = std::move(entries)};
}

FlightRecording recording_of(const std::string& name, std::int32_t core, std::vector<TraceRing> rings) {
  FlightRecording made(name, core);
  made.add(TraceListing{.pid = 0, .time_monotonic_ns = kTraceBegin});
  made.add(TraceListing{.pid = 7, .time_monotonic_ns = 9000, .rings = std::move(rings)});
  return made;
}

DecodedTrace written_trace(const std::vector<HostRecording>& hosts, TraceCounts* counts = nullptr) {
  std::string bytes;
  PerfettoTrace trace([&](std::string_view packet) { bytes += packet; });
  const TraceCounts made = write_tracks(trace, hosts, kTraceClocks);
  if (counts != nullptr) *counts = made;
  return decode(bytes);
}

TEST(TraceOfHosts, HasTheClocksOfThisMachine) {
  const DecodedTrace trace = written_trace({});
  EXPECT_EQ(trace.errors, "");
  EXPECT_THAT(trace.clocks,
              UnorderedElementsAre(std::pair(6, 5000), std::pair(3, 5000), std::pair(1, 70'000)));
  EXPECT_THAT(trace.text, HasSubstr("first_packet_on_sequence: true"));
}

TEST(TraceOfHosts, HasATrackOfEachTaskWithItsCycles) {
  const FlightRecording line1 =
      recording_of("line1", -1,
                   {told_ring(4, "Cap", {}), told_ring(3, "Fill",
                                                       {{1100, FlightKind::lost, 2},
                                                        {1100, FlightKind::start, 30},
                                                        {1200, FlightKind::end, 12},
                                                        {1200, FlightKind::moved, -4},
                                                        {1250, FlightKind::work, 50},
                                                        {1250, FlightKind::start, 0},
                                                        {1300, FlightKind::end, 0}})});
  TraceCounts counts;
  const DecodedTrace trace = written_trace({{.host = "south", .instances = {line1}}}, &counts);
  EXPECT_EQ(trace.errors, "");
  EXPECT_EQ(counts.cycles, 2U);
  EXPECT_TRUE(trace.on("south/line1/Cap").empty());
  const auto events = trace.on("south/line1/Fill");
  EXPECT_THAT(lines_of(events),
              ElementsAre("begin 1100 cycle", "instant 1100 lost", "end 1200", "begin 1200 work",
                          "instant 1200 moved", "end 1250", "begin 1250 cycle", "end 1300"));
  EXPECT_EQ(events[0].notes.at("latency_ns"), "30");
  EXPECT_EQ(events[0].notes.at("lost_releases"), "2");
  EXPECT_EQ(events[2].notes.at("spun_ahead_ns"), "12");
  EXPECT_EQ(events[4].notes.at("by_ns"), "-4");
}

TEST(TraceOfHosts, HasTheCyclesOfACoreWithinEachOther) {
  const FlightRecording line1 = recording_of(
      "line1", 2, {told_ring(3, "Slow", {{1100, FlightKind::start, 0}, {1900, FlightKind::end, 0}})});
  const FlightRecording line2 = recording_of(
      "line2", 2, {told_ring(3, "Fast", {{1300, FlightKind::start, 0}, {1400, FlightKind::end, 0}})});
  const FlightRecording line3 = recording_of("line3", 1,
                                             {told_ring(3, "Far",
                                                        {{1300, FlightKind::start, 0},
                                                         {1310, FlightKind::halted, 0},
                                                         {1390, FlightKind::resumed, 0},
                                                         {1400, FlightKind::end, 0}})});
  const DecodedTrace trace = written_trace({{.host = "south", .instances = {line1, line2, line3}}});
  EXPECT_EQ(trace.errors, "");
  EXPECT_THAT(lines_of(trace.on("south/core 2")),
              ElementsAre("begin 1100 line1/Slow", "begin 1300 line2/Fast", "end 1400", "end 1900"));
  EXPECT_THAT(lines_of(trace.on("south/core 1")),
              ElementsAre("begin 1300 line3/Far", "end 1310", "begin 1390 line3/Far", "end 1400"));
}

TEST(TraceOfHosts, HasAnArrowFromAPostToTheCycleForItInAnotherInstance) {
  const std::uint32_t mark = event_mark("line2/Go");
  const FlightRecording line1 = recording_of("line1", -1,
                                             {told_ring(3, "Poster",
                                                        {{1100, FlightKind::start, 0},
                                                         {1150, FlightKind::posted, posted_figure(mark, 17)},
                                                         {1200, FlightKind::end, 0}})});
  const FlightRecording line2 = recording_of("line2", -1,
                                             {told_ring(3, "Taker",
                                                        {{1180, FlightKind::taken, 17},
                                                         {1180, FlightKind::start, 20},
                                                         {1190, FlightKind::end, 0},
                                                         {1280, FlightKind::taken, 18},
                                                         {1280, FlightKind::start, 25},
                                                         {1290, FlightKind::end, 0}},
                                                        mark)});
  TraceCounts counts;
  const DecodedTrace trace =
      written_trace({{.host = "south", .events = {{mark, "line2/Go"}}, .instances = {line1, line2}},
                     {.host = "north", .events = {}, .instances = {line2}}},
                    &counts);
  EXPECT_EQ(trace.errors, "");
  EXPECT_EQ(counts.flows, 1U);
  const auto posted = trace.on("south/line1/Poster").at(1);
  EXPECT_EQ(posted.name, "posted line2/Go");
  const auto cycle = trace.on("south/line2/Taker").at(0);
  ASSERT_THAT(cycle.flows, SizeIs(1));
  EXPECT_EQ(posted.flows, cycle.flows);
  const auto event = trace.on("south/event line2/Go");
  EXPECT_THAT(lines_of(event), ElementsAre("instant 1150 post 17", "instant 1255 post 18"));
  EXPECT_EQ(event[0].flows, cycle.flows);
  EXPECT_EQ(event[0].notes.at("by"), "line1/Poster");
  EXPECT_EQ(event[1].notes.at("by"), "no task");
  const auto elsewhere = trace.on("north/line2/Taker").at(0);
  EXPECT_NE(elsewhere.flows, cycle.flows) << "a post of another host";
}

TEST(TraceOfHosts, APostIsNotLaterThanTheCycleForIt) {
  const std::uint32_t mark = event_mark("line1/Go");
  const FlightRecording line1 = recording_of(
      "line1", -1,
      {told_ring(3, "Taker",
                 {{1150, FlightKind::taken, 5}, {1150, FlightKind::start, 3}, {1170, FlightKind::end, 0}},
                 mark),
       told_ring(4, "Poster",
                 {{1100, FlightKind::start, 0},
                  {1180, FlightKind::posted, posted_figure(mark, 5)},
                  {1200, FlightKind::end, 0}})});
  const DecodedTrace trace = written_trace({{.host = "south", .instances = {line1}}});
  EXPECT_EQ(trace.errors, "");
  EXPECT_EQ(trace.on("south/line1/Poster").at(1).time, 1147U) << "it was pre-empted before it could tell";
}

TEST(TraceOfHosts, HasOneAxisForClocksThatDiffer) {
  const FlightRecording line1 = recording_of(
      "line1", -1, {told_ring(3, "Fill", {{1500, FlightKind::start, 0}, {1700, FlightKind::end, 0}})});
  const DecodedTrace trace = written_trace(
      {{.host = "south", .time = {.offset_ns = 400, .uncertainty_ns = 9}, .instances = {line1}},
       {.host = "north", .time = {.offset_ns = -300, .uncertainty_ns = 8}, .instances = {line1}}});
  EXPECT_EQ(trace.errors, "");
  EXPECT_THAT(lines_of(trace.on("south/line1/Fill")), ElementsAre("begin 1100 cycle", "end 1300"));
  EXPECT_THAT(lines_of(trace.on("north/line1/Fill")), ElementsAre("begin 1800 cycle", "end 2000"));
  const auto clock = trace.on("south").at(0);
  EXPECT_EQ(clock.notes.at("ahead_ns"), "400");
  EXPECT_EQ(clock.notes.at("uncertainty_ns"), "9");
  EXPECT_EQ(trace.tracks.front().pid, 1);
}

TEST(TraceOfHosts, HasWhatTheRuntimeDidWithAllTasks) {
  const FlightRecording line1 = recording_of(
      "line1", -1,
      {told_ring(kControlRing, "",
                 {{1050, FlightKind::started, 0},
                  {1500, FlightKind::held, 100},
                  {1600, FlightKind::switched, 300},
                  {1700, FlightKind::fault, fault_figure(0, std::to_underlying(FaultKind::task_watchdog))}}),
       told_ring(kWatchRing, "",
                 {{1300, FlightKind::late, 250},
                  {1650, FlightKind::struck, fault_figure(0, std::to_underlying(FaultKind::task_watchdog))}}),
       told_ring(kPollRing, "", {{1400, FlightKind::polled, 60}}),
       told_ring(3, "Fill", {{1550, FlightKind::start, 0}})});
  const DecodedTrace trace = written_trace({{.host = "south", .instances = {line1}}});
  EXPECT_EQ(trace.errors, "");
  const auto runtime = trace.on("south/line1/runtime");
  EXPECT_THAT(lines_of(runtime), ElementsAre("instant 1050 started", "begin 1400 held", "end 1500",
                                             "begin 1500 switched", "end 1600", "instant 1700 fault"));
  EXPECT_EQ(runtime.back().notes.at("task"), "Fill");
  EXPECT_EQ(runtime.back().notes.at("fault"), "task_watchdog");
  EXPECT_THAT(lines_of(trace.on("south/line1/supervision")),
              ElementsAre("begin 1050 late", "end 1300", "instant 1650 struck"));
  EXPECT_THAT(lines_of(trace.on("south/line1/event variables")),
              ElementsAre("begin 1340 polled", "end 1400"));
  EXPECT_THAT(lines_of(trace.on("south/line1/Fill")), ElementsAre("begin 1550 cycle", "end 1700"));
  EXPECT_EQ(trace.on("south/line1/Fill").back().notes.at("not_whole"), "exception");
}

TEST(TraceOfHosts, TellsWhereEntriesAreMissing) {
  FlightRecording line1("line1", -1);
  line1.add(TraceListing{.pid = 7,
                         .time_monotonic_ns = kTraceBegin,
                         .rings = {told_ring(3, "Fill", {}), told_ring(kControlRing, "", {})}});
  TraceRing some = told_ring(3, "Fill", {{1500, FlightKind::start, 0}, {1600, FlightKind::end, 0}});
  some.first = 8;
  TraceRing control = told_ring(kControlRing, "", {{1550, FlightKind::stopping, 0}});
  control.first = 2;
  line1.add(TraceListing{.pid = 7, .time_monotonic_ns = 2000, .rings = {some, control}});
  TraceCounts counts;
  const DecodedTrace trace = written_trace({{.host = "south", .instances = {line1}}}, &counts);
  EXPECT_EQ(counts.missing, 10U);
  const auto events = trace.on("south/line1/Fill");
  EXPECT_THAT(lines_of(events),
              ElementsAre("begin 1500 cycle", "instant 1500 entries are missing", "end 1600"));
  EXPECT_EQ(events[1].notes.at("count"), "8");
  EXPECT_THAT(lines_of(trace.on("south/line1/runtime")),
              ElementsAre("instant 1550 entries are missing", "instant 1550 stopping"));
}

// The file can be read, and each end has a begin, also if a host says anything at all.
TEST(TraceOfHosts, OfStrangersCanBeRead) {
  std::mt19937_64 random(11);
  const auto any = [&] { return static_cast<std::int64_t>(random()); };
  for (int round = 0; round < 10; ++round) {
    std::vector<HostRecording> hosts;
    for (const char* const host : {"south", "a\"\\\xc3\xa4"}) {
      FlightRecording made("line1", static_cast<std::int32_t>(random() % 3) - 1);
      made.add(TraceListing{.pid = 7, .time_monotonic_ns = kTraceBegin});
      for (int page = 0; page < 3; ++page) {
        TraceListing listing{.pid = static_cast<std::int32_t>(random() % 3), .time_monotonic_ns = 9000};
        for (std::uint32_t ring = 0; ring < 6; ++ring) {
          std::vector<FlightEntry> entries;
          for (std::size_t i = random() % 40; i-- > 0;) {
            entries.push_back({.time_ns = kTraceBegin + any() % 8000,
                               .kind = static_cast<FlightKind>(random() % 20),
                               .figure = random() % 2 == 0 ? any() : any() % 500});
          }
          listing.rings.push_back(
              told_ring(ring, ring % 2 == 0 ? "Fill" : "", entries, static_cast<std::uint32_t>(any())));
          listing.rings.back().first = random() % 10;
        }
        made.add(listing);
      }
      hosts.push_back({.host = host,
                       .time = {.offset_ns = any() / 8, .uncertainty_ns = any(), .drift = 1e-3},
                       .events = {},
                       .instances = {made}});
    }
    const DecodedTrace trace = written_trace(hosts);
    ASSERT_EQ(trace.errors, "") << "round " << round;
    ASSERT_THAT(trace.events, testing::Not(IsEmpty()));
  }
}

}  // namespace
}  // namespace plchost
