#include "schedulers/distributed_clock/clock_regulator.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <random>
#include <tuple>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/support/simulated_reference.hpp"

namespace plchost {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;
using Verdict = ClockRegulator::Verdict;

constexpr TimePoint kPowerOn{seconds(5000)};
constexpr double kMillionth = 1e-6;
constexpr double kNoiseNs = 200;

class Regulator : public testing::Test {
 protected:
  // Feeds pairs up to `end`; how far the line is off one spacing after each of them.
  std::vector<double> feed_until(TimePoint end) {
    std::vector<double> errors;
    for (; now < end; now += spacing) {
      last = sut.feed(reference.stamp(now));
      errors.push_back(std::abs(error_at(now + spacing)));
    }
    return errors;
  }
  [[nodiscard]] double error_at(TimePoint when) const {
    return static_cast<double>(sut.model().reference_at(when) - SimulatedReference::kEpoch) -
           reference.beyond_epoch(when);
  }
  static double percentile(std::vector<double> values, double share) {
    std::ranges::sort(values);
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  }

  DistributedClockSettings settings;
  ClockRegulator sut{settings};
  SimulatedReference reference{kPowerOn, 100 * kMillionth, kNoiseNs};
  TimePoint now = kPowerOn;
  Duration spacing = milliseconds(1);
  Verdict last = Verdict::taken;
};

TEST_F(Regulator, IsUsableAfterAFewPairsAndKnowsDriftAndPhase) {
  feed_until(kPowerOn + 7 * spacing);
  EXPECT_FALSE(sut.usable());
  feed_until(kPowerOn + 8 * spacing);
  EXPECT_TRUE(sut.usable());
  feed_until(kPowerOn + milliseconds(500));
  EXPECT_NEAR(sut.model().drift, 100 * kMillionth, 0.5 * kMillionth);
  EXPECT_LT(std::abs(error_at(now)), 100);
}

TEST_F(Regulator, HoldsTheLineTenTimesTighterThanTheNoise) {
  feed_until(kPowerOn + seconds(2));
  const auto errors = feed_until(kPowerOn + seconds(60));
  EXPECT_LT(percentile(errors, 0.5), 20);
  EXPECT_LT(percentile(errors, 0.99), 60);
}

TEST_F(Regulator, HoldsItAtAnyRateOfPairs) {
  for (const Duration rate :
       {Duration(microseconds(100)), Duration(milliseconds(10)), Duration(milliseconds(100))}) {
    sut = ClockRegulator(settings);
    spacing = rate;
    const TimePoint begin = now;
    reference.set_drift(100 * kMillionth, begin);
    feed_until(begin + 200 * rate);
    EXPECT_LT(percentile(feed_until(begin + 5000 * rate), 0.99), 60) << rate.count();
  }
}

TEST_F(Regulator, HoldsItWhenAWriterIsLateAndCatchesUpInBursts) {
  feed_until(kPowerOn + seconds(2));
  std::mt19937_64 random(5);
  std::vector<double> errors;
  while (now < kPowerOn + seconds(60)) {
    const Duration gap = milliseconds(1 + static_cast<int>(random() % 30));
    const TimePoint late = now + gap;
    for (int i = 0; i < gap / milliseconds(1); ++i) sut.feed(reference.stamp(late + i * microseconds(25)));
    now = late + milliseconds(1);
    for (int ms = 0; ms < 15; ++ms) errors.push_back(std::abs(error_at(now + milliseconds(ms))));
  }
  EXPECT_LT(percentile(errors, 0.99), 150);
}

TEST_F(Regulator, FollowsADriftThatChangesSuddenly) {
  feed_until(kPowerOn + seconds(5));
  reference.set_drift(-200 * kMillionth, now);
  feed_until(now + milliseconds(500));
  EXPECT_EQ(last, Verdict::taken);
  EXPECT_LT(percentile(feed_until(now + seconds(5)), 0.99), 60);
  EXPECT_NEAR(sut.model().drift, -200 * kMillionth, 1 * kMillionth);
}

TEST_F(Regulator, LeavesASingleWildPairOut) {
  feed_until(kPowerOn + seconds(3));
  for (const Duration wild :
       {Duration(microseconds(50)), Duration(milliseconds(-3)), Duration(seconds(90'000))}) {
    ReferencePair pair = reference.stamp(now);
    pair.reference_ns += wild.count();
    const double before = error_at(now + milliseconds(1));
    EXPECT_EQ(sut.feed(pair), Verdict::outlier);
    now += spacing;
    EXPECT_DOUBLE_EQ(error_at(now), before);
    EXPECT_LT(percentile(feed_until(now + milliseconds(100)), 1), 100);
  }
}

TEST_F(Regulator, KeepsTheLineThoughEveryTenthPairIsWild) {
  std::mt19937_64 random(7);
  std::uniform_int_distribution<std::int64_t> wild(-1'000'000, 1'000'000);
  feed_until(kPowerOn + seconds(2));
  std::vector<double> errors;
  for (int i = 0; i < 30'000; ++i, now += spacing) {
    ReferencePair pair = reference.stamp(now);
    if (i % 10 == 0) pair.reference_ns += wild(random);
    sut.feed(pair);
    errors.push_back(std::abs(error_at(now + spacing)));
  }
  EXPECT_LT(percentile(errors, 0.99), 100);
}

TEST_F(Regulator, FollowsAStepAfterPairsThatAgreeAndKeepsTheDrift) {
  feed_until(kPowerOn + seconds(3));
  reference.step(milliseconds(7));
  for (std::uint32_t i = 1; i < ClockRegulator::kStepPairs; ++i, now += spacing) {
    EXPECT_EQ(sut.feed(reference.stamp(now)), Verdict::outlier);
  }
  EXPECT_EQ(sut.feed(reference.stamp(now)), Verdict::stepped);
  EXPECT_LT(std::abs(error_at(now)), 2 * kNoiseNs);
  EXPECT_NEAR(sut.model().drift, 100 * kMillionth, 1 * kMillionth);
  now += spacing;
  feed_until(now + milliseconds(300));
  EXPECT_LT(percentile(feed_until(now + seconds(5)), 0.99), 60);
}

TEST_F(Regulator, FollowsATimeThatRunsBackwardsAsAStep) {
  feed_until(kPowerOn + seconds(3));
  reference.step(-seconds(86'400));
  feed_until(now + milliseconds(300));
  EXPECT_EQ(last, Verdict::taken);
  EXPECT_LT(percentile(feed_until(now + seconds(5)), 0.99), 60);
}

TEST_F(Regulator, RecoversFromAWildFirstPair) {
  ReferencePair pair = reference.stamp(now);
  pair.reference_ns -= 123'456'789'012;
  EXPECT_EQ(sut.feed(pair), Verdict::taken);
  now += spacing;
  feed_until(now + milliseconds(300));
  EXPECT_LT(percentile(feed_until(now + seconds(5)), 0.99), 60);
}

TEST_F(Regulator, WidensItsToleranceForANoisyReference) {
  reference = SimulatedReference(kPowerOn, 100 * kMillionth, 20'000);
  feed_until(kPowerOn + seconds(5));
  EXPECT_LT(percentile(feed_until(kPowerOn + seconds(30)), 0.99), 6'000);
}

TEST_F(Regulator, FollowsANoiseThatGrows) {
  for (const double noise_ns : {1'000.0, 5'000.0, 50'000.0}) {
    sut = ClockRegulator(settings);
    const TimePoint begin = now;
    reference = SimulatedReference(begin, 100 * kMillionth, kNoiseNs);
    feed_until(begin + seconds(3));
    reference = SimulatedReference(begin, 100 * kMillionth, noise_ns, 2);
    feed_until(begin + seconds(8));
    EXPECT_LT(percentile(feed_until(begin + seconds(30)), 0.99), 0.3 * noise_ns);
    EXPECT_EQ(last, Verdict::taken);
    EXPECT_NEAR(sut.model().drift, 100 * kMillionth, 20 * kMillionth);
  }
}

TEST_F(Regulator, StepsInNoiseAreFollowed) {
  reference = SimulatedReference(kPowerOn, 100 * kMillionth, 20'000);
  feed_until(kPowerOn + seconds(5));
  reference.step(milliseconds(1));
  feed_until(now + milliseconds(100));
  EXPECT_LT(percentile(feed_until(now + seconds(5)), 0.99), 8'000);
}

TEST_F(Regulator, StepOntoALineOfAnotherDriftIsFollowed) {
  for (const double drift : {3000 * kMillionth, -4000 * kMillionth, 100 * kMillionth}) {
    feed_until(now + seconds(3));
    reference.step(milliseconds(3));
    reference.set_drift(drift, now);
    feed_until(now + milliseconds(300));
    EXPECT_LT(percentile(feed_until(now + seconds(5)), 0.99), 60);
    EXPECT_NEAR(sut.model().drift, drift, 1 * kMillionth);
  }
}

/// The time of a broken reference at a local time, at this distance of its pairs.
struct Broken {
  const char* name;
  std::int64_t (*shows)(Duration since, std::mt19937_64& random);
};

class BrokenReference : public Regulator, public testing::WithParamInterface<std::tuple<Broken, Duration>> {
 protected:
  // How many of its pairs are taken for a clock's; a step counts as all.
  int taken_of(int pairs) {
    const TimePoint begin = now;
    const std::int64_t shown = reference.stamp(begin).reference_ns;
    int taken = 0;
    for (int i = 0; i < pairs; ++i) {
      now += spacing;
      const std::int64_t broken = shown + std::get<Broken>(GetParam()).shows(now - begin, random_);
      const Verdict verdict = sut.feed({.local = now, .reference_ns = broken});
      if (verdict == Verdict::taken) ++taken;
      if (verdict == Verdict::stepped) taken += pairs;
    }
    now += spacing;
    return taken;
  }

 private:
  std::mt19937_64 random_{4};
};

TEST_P(BrokenReference, IsNeverFollowedAndTheRightOneAtOnce) {
  spacing = std::get<Duration>(GetParam());
  feed_until(kPowerOn + 4000 * spacing);
  const double drift = sut.model().drift;
  EXPECT_LE(taken_of(6000), 3);
  EXPECT_NEAR(sut.model().drift, drift, 20 * kMillionth) << "the drift of hold-over";
  feed_until(now + 200 * spacing);
  EXPECT_EQ(last, Verdict::taken);
  EXPECT_LT(percentile(feed_until(now + 4000 * spacing), 0.99), 100);
}

TEST_P(BrokenReference, IsNotFollowedFromTheStart) {
  spacing = std::get<Duration>(GetParam());
  EXPECT_LT(taken_of(6000), 30);
  EXPECT_FALSE(sut.usable());
  feed_until(now + 500 * spacing);
  EXPECT_LT(percentile(feed_until(now + 4000 * spacing), 0.99), 100);
}

TEST_P(BrokenReference, IsNotFollowedAfterANoisyOne) {
  spacing = std::get<Duration>(GetParam());
  reference = SimulatedReference(kPowerOn, 100 * kMillionth, 5'000);
  feed_until(kPowerOn + 4000 * spacing);
  const double drift = sut.model().drift;
  EXPECT_LE(taken_of(6000), 3);
  EXPECT_NEAR(sut.model().drift, drift, 20 * kMillionth);
}

constexpr std::array kBroken = {
    Broken{"Frozen", [](Duration, std::mt19937_64&) { return std::int64_t{0}; }},
    Broken{"Backwards", [](Duration since, std::mt19937_64&) { return std::int64_t{-since.count()}; }},
    Broken{"HalfSpeed", [](Duration since, std::mt19937_64&) { return std::int64_t{since.count() / 2}; }},
    Broken{"DoubleSpeed", [](Duration since, std::mt19937_64&) { return std::int64_t{since.count() * 2}; }},
    Broken{"Random",
           [](Duration, std::mt19937_64& random) { return static_cast<std::int64_t>(random() >> 3U); }},
    Broken{"RandomWithinASecond",
           [](Duration since, std::mt19937_64& random) {
             return since.count() + static_cast<std::int64_t>(random() % 2'000'000'000) - 1'000'000'000;
           }},
};

INSTANTIATE_TEST_SUITE_P(Kinds, BrokenReference,
                         testing::Combine(testing::ValuesIn(kBroken),
                                          testing::Values(Duration(microseconds(250)), milliseconds(1),
                                                          milliseconds(10))),
                         [](const auto& of) {
                           return fmt::format("{}Each{}us", std::get<Broken>(of.param).name,
                                              std::get<Duration>(of.param) / microseconds(1));
                         });

TEST_F(Regulator, KeepsTheDriftOverASilenceAndFindsBackQuickly) {
  feed_until(kPowerOn + seconds(5));
  now += seconds(60);
  EXPECT_LT(std::abs(error_at(now)), 60'000) << "1 ppm of a minute";
  feed_until(now + milliseconds(200));
  EXPECT_LT(percentile(feed_until(now + seconds(5)), 0.99), 60);
}

TEST_F(Regulator, RefusesStampsOutOfOrderAndOutOfRange) {
  feed_until(kPowerOn + seconds(1));
  const ClockModel before = sut.model();
  ReferencePair pair = reference.stamp(before.local);
  EXPECT_EQ(sut.feed(pair), Verdict::out_of_order);
  pair.local -= seconds(1);
  EXPECT_EQ(sut.feed(pair), Verdict::out_of_order);
  pair.local = TimePoint::min() + seconds(10'000);
  EXPECT_EQ(sut.feed(pair), Verdict::out_of_order);
  pair.local = now;
  for (const std::int64_t wild :
       {std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min(),
        ClockRegulator::kMaxReferenceNs + 1, -ClockRegulator::kMaxReferenceNs - 1}) {
    pair.reference_ns = wild;
    EXPECT_EQ(sut.feed(pair), Verdict::out_of_range);
  }
  pair = reference.stamp(before.local + ClockRegulator::kMinSpacing - Duration(1));
  EXPECT_EQ(sut.feed(pair), Verdict::skipped);
  EXPECT_EQ(sut.model().drift, before.drift);
  EXPECT_EQ(sut.model().reference_ns, before.reference_ns);
}

TEST_F(Regulator, StaysFiniteAndBoundedWhateverItIsFed) {
  std::mt19937_64 random(99);
  for (int i = 0; i < 200'000; ++i) {
    now += Duration(1 + static_cast<Duration::rep>(random() % 3'000'000));
    ReferencePair pair{.local = now, .reference_ns = static_cast<std::int64_t>(random())};
    if (random() % 3 == 0) pair = reference.stamp(now);
    if (random() % 7 == 0) pair.reference_ns = 0;
    sut.feed(pair);
    ASSERT_TRUE(std::isfinite(sut.model().drift) && std::isfinite(sut.model().fraction_ns));
    ASSERT_TRUE(std::isfinite(sut.bias_ns()));
    ASSERT_LE(std::abs(sut.model().drift), ClockRegulator::kMaxDrift);
  }
  reference.set_drift(50 * kMillionth, now);
  feed_until(now + seconds(3));
  EXPECT_LT(percentile(feed_until(now + seconds(3)), 0.99), 100) << "and finds back to a good reference";
}

}  // namespace
}  // namespace plchost
