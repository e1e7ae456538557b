#include "schedulers/distributed_clock/distributed_clock.hpp"

#include <algorithm>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/simulated_reference.hpp"

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr double kPpm = 1e-6;
constexpr TimePoint kOrigin{seconds(5000)};

TEST(DeviationFromGrid, IsSignedAndAtMostHalfOfAnInterval) {
  const ClockModel model{.local = kOrigin, .reference_ns = 7'000'000};
  const auto at = [&](Duration since) {
    return deviation_from_grid(model, kOrigin + since, milliseconds(1), {});
  };
  EXPECT_EQ(at({}), Duration::zero());
  EXPECT_EQ(at(microseconds(499)), microseconds(499));
  EXPECT_EQ(at(microseconds(500)), microseconds(500));
  EXPECT_EQ(at(microseconds(501)), microseconds(-499));
  EXPECT_EQ(at(microseconds(-1)), microseconds(-1));
  EXPECT_EQ(at(milliseconds(40) + Duration(3)), Duration(3));
  EXPECT_EQ(deviation_from_grid(model, kOrigin, milliseconds(1), microseconds(300)), microseconds(-300));
  EXPECT_EQ(deviation_from_grid(model, kOrigin, milliseconds(1), microseconds(5700)), microseconds(300))
      << "an offset beyond the interval counts modulo it";
}

TEST(DeviationFromGrid, CountsNegativeReferenceTimes) {
  const ClockModel model{.local = kOrigin, .reference_ns = -7'000'100};
  EXPECT_EQ(deviation_from_grid(model, kOrigin, milliseconds(1), {}), Duration(-100));
}

TEST(CorrectionBound, IsOnePercentOfTheIntervalUnlessSet) {
  DistributedClockSettings settings;
  EXPECT_EQ(correction_bound(settings, milliseconds(1)), microseconds(10));
  EXPECT_EQ(correction_bound(settings, Duration(50)), Duration(1));
  settings.max_correction = Duration(700);
  EXPECT_EQ(correction_bound(settings, milliseconds(1)), Duration(700));
}

TEST(SyncWatch, ComesInWithinHalfOfTheWindowAndFallsOutBeyondIt) {
  SyncWatch sut(microseconds(50));
  for (int i = 1; i < SyncWatch::kReleases; ++i) EXPECT_FALSE(sut.record(microseconds(25)));
  EXPECT_FALSE(sut.record(microseconds(-26))) << "begins to count anew";
  for (int i = 1; i < SyncWatch::kReleases; ++i) EXPECT_FALSE(sut.record(microseconds(-25)));
  EXPECT_TRUE(sut.record(microseconds(25)));
  EXPECT_TRUE(sut.record(microseconds(-50)));
  EXPECT_FALSE(sut.record(microseconds(51)));
  EXPECT_FALSE(sut.record(microseconds(26)));
}

/// One cyclic task that plans its releases, and firmware that writes a pair shortly before each of them.
class Following : public testing::Test {
 protected:
  static constexpr Duration kInterval = milliseconds(1);

  Following() {
    EXPECT_TRUE(sut.use_source(&record));
    sut.configure(settings);
    sut.set_steering(true);
  }

  // Runs `cycles`; the true deviations of the planned releases.
  std::vector<double> run(int cycles) {
    std::vector<double> deviations;
    for (int i = 0; i < cycles; ++i) {
      const TimePoint now = release + microseconds(20);
      if (writing) record.write(reference.stamp(now - microseconds(150)));
      release += kInterval;
      const Duration correction = follower.correction(release, kInterval, offset, now);
      EXPECT_LE(std::abs(correction.count()), correction_bound(settings, kInterval).count());
      release += correction;
      deviations.push_back(std::abs(reference.deviation_ns(release, kInterval, offset)));
    }
    return deviations;
  }
  static double percentile(std::vector<double> values, double share) {
    std::ranges::sort(values);
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  }
  [[nodiscard]] ClockStatus status() const { return sut.status(follower); }

  DistributedClockSettings settings;
  SimulatedReference reference{kOrigin - microseconds(300), 100 * kPpm, 200};
  FakeRecord record;
  DistributedClock sut;
  ClockFollower& follower = sut.add_follower(3);
  TimePoint release = kOrigin;
  Duration offset{};
  bool writing = true;
};

TEST_F(Following, SettlesFromFarOffAndHoldsTheGrid) {
  const auto first = run(200);
  EXPECT_GT(first.front(), 100'000);
  EXPECT_EQ(status().state, ClockState::locked);
  run(1800);
  EXPECT_LT(percentile(run(58'000), 0.99), 100) << "in nanoseconds, of a minute";
  EXPECT_TRUE(status().in_sync);
  EXPECT_NEAR(static_cast<double>(status().drift_ppb), 100'000, 1000);
  EXPECT_LT(std::abs(status().offset_ns), 200);
  EXPECT_EQ(status().correction_max_ns, 10'000);
  EXPECT_GT(status().corrections_at_bound, 20U);
  EXPECT_EQ(status().rejected, 0U);
}

TEST_F(Following, KeepsItsOffsetFromTheReferenceGrid) {
  offset = microseconds(250);
  run(2000);
  EXPECT_LT(percentile(run(10'000), 0.99), 100);
}

TEST_F(Following, SaysWhereItIs) {
  writing = false;
  run(10);
  EXPECT_EQ(status().state, ClockState::free_running);
  writing = true;
  run(5);
  EXPECT_EQ(status().state, ClockState::acquiring);
  EXPECT_EQ(status().correction_max_ns, 0) << "too few pairs to move anything";
  run(1000);
  EXPECT_EQ(status().state, ClockState::locked);
  writing = false;
  run(200);
  EXPECT_EQ(status().state, ClockState::locked) << "within the timeout";
  run(200);
  EXPECT_EQ(status().state, ClockState::hold_over);
  EXPECT_TRUE(status().in_sync);
  run(10'000);
  EXPECT_EQ(status().state, ClockState::hold_over);
  EXPECT_FALSE(status().in_sync) << "beyond the limit of the hold-over";
  writing = true;
  run(1000);
  EXPECT_EQ(status().state, ClockState::locked);
}

TEST_F(Following, GoesOnWithTheLastDriftWhenTheReferenceStops) {
  run(5000);
  writing = false;
  EXPECT_LT(percentile(run(10'000), 1), 5000) << "half a ppm of ten seconds";
}

TEST_F(Following, LocksAgainAfterADropOutWithoutAJump) {
  run(5000);
  writing = false;
  run(30'000);
  reference.step(microseconds(400));
  writing = true;
  run(2000);  // which checks the bound of each correction
  EXPECT_LT(percentile(run(5000), 0.99), 100);
  EXPECT_EQ(status().state, ClockState::locked);
}

TEST_F(Following, IgnoresAWildPairAndFollowsAStep) {
  run(3000);
  ReferencePair wild = reference.stamp(release - microseconds(130));
  wild.reference_ns += 400'000;
  record.write(wild);
  writing = false;
  run(1);
  writing = true;
  EXPECT_EQ(status().rejected, 1U);
  EXPECT_LT(percentile(run(100), 1), 200);
  EXPECT_EQ(status().steps, 0U);
  reference.step(microseconds(200));
  run(10);
  EXPECT_FALSE(status().in_sync);
  EXPECT_EQ(status().state, ClockState::acquiring);
  EXPECT_EQ(status().steps, 1U);
  run(500);
  EXPECT_LT(percentile(run(5000), 0.99), 100);
  EXPECT_EQ(status().state, ClockState::locked);
}

TEST_F(Following, HoldsOverWhileTheWriterSaysInvalid) {
  run(3000);
  writing = false;
  for (int i = 0; i < 400; ++i) {
    record.write_invalid();
    run(1);
  }
  EXPECT_EQ(status().state, ClockState::hold_over);
  EXPECT_EQ(status().invalid, 400U);
}

/// A reference that goes on stamping, freshly and as valid, after it has broken.
class FollowingBroken : public Following, public testing::WithParamInterface<const char*> {
 protected:
  std::int64_t shown(Duration since) {
    const std::string_view kind = GetParam();
    if (kind == "Frozen") return 0;
    if (kind == "Backwards") return -since.count();
    if (kind == "HalfSpeed") return since.count() / 2;
    return static_cast<std::int64_t>(random_() >> 3U);
  }
  void run_broken(int cycles) {
    writing = false;
    const ReferencePair last = reference.stamp(release);
    for (int i = 0; i < cycles; ++i) {
      record.write({.local = release, .reference_ns = last.reference_ns + shown(release - last.local)});
      run(1);
      EXPECT_LE(std::abs(status().offset_ns), kInterval / Duration(2));
    }
    writing = true;
  }

 private:
  std::mt19937_64 random_{11};
};

TEST_P(FollowingBroken, IsHoldOverAndLocksAgainWithoutAJump) {
  run(5000);
  const std::int64_t drift = status().drift_ppb;
  const auto at_bound = status().corrections_at_bound;
  run_broken(250);
  EXPECT_EQ(status().state, ClockState::locked) << "within the timeout";
  run_broken(4000);
  EXPECT_EQ(status().state, ClockState::hold_over);
  EXPECT_TRUE(status().in_sync);
  EXPECT_NEAR(static_cast<double>(status().drift_ppb), static_cast<double>(drift), 500);
  EXPECT_GT(status().rejected, 4000U);
  EXPECT_LT(std::abs(reference.deviation_ns(release, kInterval)), 5000) << "the grid went on";
  EXPECT_LT(percentile(run(100), 1), 5000);
  EXPECT_EQ(status().state, ClockState::locked);
  EXPECT_EQ(status().corrections_at_bound, at_bound);
  EXPECT_EQ(status().steps, 0U);
  run(500);
  EXPECT_LT(percentile(run(5000), 0.99), 100);
}

TEST_P(FollowingBroken, IsToldAfterTheTimeoutAndNoLongerThanItLasts) {
  const auto why =
      GetParam() == std::string_view("Frozen") ? ClockSilence::stands_still : ClockSilence::no_clock;
  run_broken(250);
  EXPECT_EQ(status().silence, ClockSilence::none) << "within the timeout";
  run_broken(2000);
  EXPECT_EQ(status().silence, why);
  run(1000);
  EXPECT_EQ(status().silence, ClockSilence::none);
  run_broken(250);
  EXPECT_EQ(status().silence, ClockSilence::none);
  run_broken(2000);
  EXPECT_EQ(status().silence, why);
}

TEST_P(FollowingBroken, MovesNothingIfThereWasNoOtherYet) {
  run_broken(200);
  EXPECT_EQ(status().state, ClockState::acquiring);
  run_broken(2000);
  EXPECT_EQ(status().state, ClockState::free_running);
  EXPECT_EQ(status().correction_max_ns, 0);
  run(1000);
  EXPECT_EQ(status().state, ClockState::locked);
}

TEST_P(FollowingBroken, IsNoHoldOverInSyncForEver) {
  run(2000);
  run_broken(11'000);
  EXPECT_EQ(status().state, ClockState::hold_over);
  EXPECT_FALSE(status().in_sync);
}

INSTANTIATE_TEST_SUITE_P(Kinds, FollowingBroken,
                         testing::Values("Frozen", "Backwards", "HalfSpeed", "Random"),
                         [](const auto& of) { return std::string(of.param); });

TEST_F(Following, GrowingNoiseIsFollowed) {
  run(5000);
  reference = SimulatedReference(kOrigin - microseconds(300), 100 * kPpm, 5000, 3);
  run(2000);
  EXPECT_EQ(status().state, ClockState::locked);
  const auto rejected = status().rejected;
  EXPECT_LT(percentile(run(5000), 0.99), 2000);
  EXPECT_EQ(status().rejected, rejected);
}

TEST_F(Following, RejectsCorruptRecordsAndStampsOfAnotherTime) {
  run(3000);
  const auto pairs = status().pairs;
  writing = false;
  record.corrupt();
  run(3);
  EXPECT_EQ(status().rejected, 3U);
  ReferencePair pair = reference.stamp(release);
  pair.local = release + seconds(1);
  record.write(pair);
  run(1);
  pair.local = release - seconds(1);
  record.write(pair);
  run(1);
  pair.local = TimePoint::max();
  record.write(pair);
  run(1);
  pair.local = TimePoint::min();
  record.write(pair);
  run(1);
  EXPECT_EQ(status().rejected, 7U);
  EXPECT_EQ(status().pairs, pairs);
}

TEST_F(Following, SaysWhyNoPairIsTaken) {
  writing = false;
  run(250);
  EXPECT_EQ(status().silence, ClockSilence::none);
  run(100);
  EXPECT_EQ(status().silence, ClockSilence::nothing);
  writing = true;
  run(1000);
  EXPECT_EQ(status().silence, ClockSilence::none);
  writing = false;
  run(400);
  EXPECT_EQ(status().silence, ClockSilence::nothing);
  record.write_invalid();
  run(1);
  EXPECT_EQ(status().silence, ClockSilence::invalid);
  record.corrupt();
  run(1);
  EXPECT_EQ(status().silence, ClockSilence::corrupt);
  ReferencePair old = reference.stamp(release);
  old.local = release - seconds(1);
  record.write(old);
  run(1);
  EXPECT_EQ(status().silence, ClockSilence::other_time);
  run(400);
  EXPECT_EQ(status().silence, ClockSilence::nothing) << "that was before";
  sut.configure(settings);
  EXPECT_EQ(status().silence, ClockSilence::none);
}

TEST_F(Following, OnlyMeasuresWhereReleasesCannotBeMoved) {
  sut.set_steering(false);
  run(1000);
  EXPECT_EQ(status().state, ClockState::measuring);
  EXPECT_FALSE(status().in_sync);
  EXPECT_EQ(status().correction_max_ns, 0);
  EXPECT_NEAR(static_cast<double>(status().drift_ppb), 100'000, 2000);
  EXPECT_NEAR(static_cast<double>(status().offset_ns), reference.deviation_ns(release, kInterval), 500);
  sut.set_steering(true);
  run(500);
  EXPECT_EQ(status().state, ClockState::locked);
}

TEST_F(Following, NeverMovesAReleaseByMoreThanItsBoundWhateverTheReferenceDoes) {
  settings.max_correction = Duration(1234);
  sut.configure(settings);
  std::mt19937_64 random(3);
  for (int round = 0; round < 300; ++round) {
    writing = random() % 8 != 0;
    if (random() % 5 == 0)
      reference.step(Duration(static_cast<Duration::rep>(random() % 2'000'000'000) - 1'000'000'000));
    reference.set_drift(static_cast<double>(random() % 400) * kPpm - 200 * kPpm, release);
    if (random() % 9 == 0)
      record.write({.local = release, .reference_ns = static_cast<std::int64_t>(random())});
    run(200);  // which checks each correction
  }
  EXPECT_EQ(status().correction_max_ns, 1234);
}

TEST_F(Following, LearnsAnewWhenItIsConfiguredAnew) {
  run(3000);
  sut.configure(settings);
  EXPECT_FALSE(status().in_sync);
  EXPECT_EQ(status().state, ClockState::free_running);
  run(1000);
  EXPECT_EQ(status().state, ClockState::locked);
}

TEST_F(Following, EachTaskHasItsOwnGridOnTheOneClock) {
  ClockFollower& slow = sut.add_follower(9);
  EXPECT_EQ(sut.leading(), &follower);
  TimePoint slow_release = kOrigin + microseconds(777);
  for (int i = 0; i < 1000; ++i) {
    run(4);
    slow_release += milliseconds(4);
    slow_release += slow.correction(slow_release, milliseconds(4), microseconds(100), release);
  }
  EXPECT_LT(std::abs(reference.deviation_ns(slow_release, milliseconds(4), microseconds(100))), 200);
  EXPECT_TRUE(sut.status(slow).in_sync);
}

TEST(DistributedClock, TakesWhatTheApplicationReportsUnlessThereIsARecord) {
  DistributedClock sut;
  ClockFollower& follower = sut.add_follower(0);
  sut.configure({});
  sut.set_steering(true);
  EXPECT_EQ(sut.status(follower).state, ClockState::off);
  EXPECT_EQ(follower.correction(kOrigin, milliseconds(1), {}, kOrigin), Duration::zero());
  SimulatedReference reference(kOrigin, 20 * kPpm, 50);
  TimePoint release = kOrigin;
  for (int i = 0; i < 1000; ++i) {
    EXPECT_TRUE(sut.report(reference.stamp(release)));
    const TimePoint now = release;
    release += milliseconds(1);
    release += follower.correction(release, milliseconds(1), {}, now);
  }
  EXPECT_EQ(sut.status(follower).state, ClockState::locked);
  FakeRecord record;
  EXPECT_TRUE(sut.use_source(&record));
  EXPECT_FALSE(sut.report(reference.stamp(release)));
  EXPECT_TRUE(sut.use_source(nullptr));
}

}  // namespace
}  // namespace plchost
