#include "tests/bench/cycle_log.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace plchost::bench {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr Duration kPeriod = milliseconds(1);
constexpr TimePoint kOrigin{std::chrono::seconds(5)};

Cycle cycle(Duration release, Duration latency) {
  return {kOrigin + release, kOrigin + release + latency};
}

std::vector<Cycle> on_time(int from, int to, Duration phase = {}) {
  std::vector<Cycle> cycles;
  for (int i = from; i < to; ++i) cycles.push_back(cycle(i * kPeriod + phase, microseconds(10)));
  return cycles;
}

/// A loop that skips: stalled at `at` for `length`, it runs once, late, and goes on with the next release.
std::vector<Cycle> with_stall(int at, Duration length, int to, Duration phase = {}) {
  auto cycles = on_time(0, at, phase);
  cycles.push_back(cycle(at * kPeriod + phase, length));
  for (const Cycle& one : on_time(at + 1 + static_cast<int>(length / kPeriod), to, phase))
    cycles.push_back(one);
  return cycles;
}

/// A loop that replays what it missed, back to back.
std::vector<Cycle> with_replay(int at, Duration length, int to) {
  std::vector<Cycle> cycles = on_time(0, at);
  for (int i = at; i < to; ++i) {
    const Duration late = at * kPeriod + length - i * kPeriod;
    cycles.push_back(cycle(i * kPeriod, std::max<Duration>(late, microseconds(10))));
  }
  return cycles;
}

TEST(CycleLog, KeepsWhatWasReleasedBetweenTheEnds) {
  CycleLog sut(10);
  for (const Cycle& one : on_time(0, 10)) sut.add(one);
  const auto between = sut.between(kOrigin + 2 * kPeriod, kOrigin + 5 * kPeriod);
  ASSERT_EQ(between.size(), 3U);
  EXPECT_EQ(between.front().release, kOrigin + 2 * kPeriod);
}

TEST(CycleLog, DropsWhatDoesNotFitInsteadOfAllocating) {
  CycleLog sut(2);
  for (const Cycle& one : on_time(0, 10)) sut.add(one);
  EXPECT_EQ(sut.between(kOrigin, kOrigin + 10 * kPeriod).size(), 2U);
}

TEST(LostCycles, AreTheReleasesThatNoCycleRanFor) {
  EXPECT_EQ(lost_cycles(on_time(0, 100), kPeriod), 0U);
  EXPECT_EQ(lost_cycles(with_stall(20, microseconds(3500), 100), kPeriod), 3U);
  EXPECT_EQ(lost_cycles(with_replay(20, microseconds(3500), 100), kPeriod), 0U);
}

TEST(Stalls, SeenByBothLoopsCountOnce) {
  const auto found = find_stalls(with_stall(20, microseconds(3500), 100),
                                 with_stall(20, microseconds(3000), 100, kPeriod / 2), kPeriod);
  EXPECT_EQ(found.stalls, 1U);
  EXPECT_EQ(found.late_ours, 1U);
  EXPECT_EQ(found.late_floor, 1U);
  EXPECT_EQ(found.lost_ours, 3U);
  EXPECT_EQ(found.lost_floor, 3U);
}

TEST(Stalls, SeenByOneLoopOnlyAreNotTheHosts) {
  EXPECT_EQ(find_stalls(with_stall(20, microseconds(3500), 100), on_time(0, 100), kPeriod).stalls, 0U);
  EXPECT_EQ(find_stalls(on_time(0, 100), with_stall(20, microseconds(3500), 100), kPeriod).stalls, 0U);
}

TEST(Stalls, ApartFromEachOtherCountEach) {
  auto ours = with_stall(20, microseconds(2500), 60);
  auto floor = with_stall(20, microseconds(2500), 60);
  for (auto* cycles : {&ours, &floor}) {
    cycles->push_back(cycle(60 * kPeriod, milliseconds(4)));
    cycles->push_back(cycle(65 * kPeriod, microseconds(10)));
  }
  const auto found = find_stalls(ours, floor, kPeriod);
  EXPECT_EQ(found.stalls, 2U);
  EXPECT_EQ(found.late_ours, 2U);
  EXPECT_EQ(found.lost_ours, 2U + 4U);
}

TEST(Stalls, ShowALoopThatReplays) {
  const auto found =
      find_stalls(with_replay(20, microseconds(3500), 100), with_stall(20, microseconds(3500), 100), kPeriod);
  EXPECT_EQ(found.stalls, 1U);
  EXPECT_EQ(found.late_ours, 3U);
  EXPECT_EQ(found.late_floor, 1U);
}

}  // namespace
}  // namespace plchost::bench
