#include "api/gateway/host_numbers.hpp"

#include <gmock/gmock.h>

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr TimePoint kStart = TimePoint(std::chrono::hours(1));

HostClaim claim(const std::string& host, std::uint16_t number, std::int64_t since = 100,
                std::uint64_t epoch = 1) {
  HostClaim made{.host = host, .number = number, .since_ns = since, .epoch = epoch, .participant = {}};
  made.participant.bytes[0] = static_cast<std::uint8_t>(epoch);
  return made;
}

TEST(HostNumbers, KnowsWhoHasWhichNumber) {
  HostNumbers sut(claim("north", 1));
  sut.claim(claim("south", 2), kStart);
  sut.claim(claim("west", 3), kStart);
  const auto others = sut.others();
  ASSERT_EQ(others.size(), 2U);
  EXPECT_EQ(others.at(2).host, "south");
  EXPECT_TRUE(sut.serves(kStart));
  sut.forget("south", kStart);
  EXPECT_EQ(sut.others().size(), 1U);
}

TEST(HostNumbers, OfTwoOthersOfOneNumberTheOneThatStartedFirstHasIt) {
  HostNumbers sut(claim("north", 1));
  sut.claim(claim("late", 2, 200), kStart);
  sut.claim(claim("early", 2, 100), kStart);
  EXPECT_EQ(sut.others().at(2).host, "early");
  sut.claim(claim("a-twin", 2, 100), kStart);
  EXPECT_EQ(sut.others().at(2).host, "a-twin") << "of equal age the lesser name";
  sut.forget("early", kStart);
  sut.forget("a-twin", kStart);
  EXPECT_EQ(sut.others().at(2).host, "late");
}

TEST(HostNumbers, AHostWhoseNumberAnotherHasLongerDoesNotServe) {
  HostNumbers sut(claim("north", 1, 100));
  sut.claim(claim("older", 1, 50), kStart);
  EXPECT_FALSE(sut.serves(kStart));
  ASSERT_TRUE(sut.ahead());
  EXPECT_EQ(sut.ahead()->host, "older");
  EXPECT_TRUE(sut.others().empty()) << "its own number is nobody else's";
}

TEST(HostNumbers, AHostWhoseClockWasSetBackIsHeardAgain) {
  HostNumbers sut(claim("north", 1));
  sut.claim(claim("south", 2, 100, 9), kStart);
  sut.claim(claim("south", 3, 100, 7), kStart);
  EXPECT_TRUE(sut.others().contains(2)) << "it may be a late last word";
  sut.claim(claim("south", 3, 100, 7), kStart + 2 * kServerGone);
  EXPECT_FALSE(sut.others().contains(2));
  ASSERT_TRUE(sut.others().contains(3));
  EXPECT_EQ(sut.others().at(3).epoch, 7U);
}

TEST(HostNumbers, TheNumberIsFreeSomeTimeAfterItsOwnerHasGone) {
  constexpr Duration kLittle = std::chrono::milliseconds(1);
  HostNumbers sut(claim("north", 1, 100));
  sut.claim(claim("older", 1, 50), kStart);
  const TimePoint gone = kStart + std::chrono::hours(1);
  sut.forget("older", gone);
  EXPECT_FALSE(sut.ahead());
  EXPECT_FALSE(sut.serves(gone + HostNumbers::kGrace)) << "it may be back";
  EXPECT_TRUE(sut.serves(gone + HostNumbers::kGrace + kLittle));
}

TEST(HostNumbers, AYoungerHostOfTheSameNumberIsNamedAndChangesNothing) {
  HostNumbers sut(claim("north", 1, 100));
  sut.claim(claim("young", 1, 150), kStart);
  EXPECT_TRUE(sut.serves(kStart));
  ASSERT_EQ(sut.behind().size(), 1U);
  EXPECT_EQ(sut.behind()[0].host, "young");
}

TEST(HostNumbers, WhatAServerSaidThatIsGoneDoesNotCountAgainstItsNextOne) {
  HostNumbers sut(claim("north", 1));
  sut.claim(claim("south", 2, 100, 20), kStart);
  sut.claim(claim("south", 3, 100, 10), kStart);
  EXPECT_TRUE(sut.others().contains(2));
  EXPECT_FALSE(sut.others().contains(3));
  sut.claim(claim("south", 4, 100, 30), kStart);
  EXPECT_TRUE(sut.others().contains(4));
  EXPECT_FALSE(sut.others().contains(2));
}

TEST(HostNumbers, IgnoresItselfAndWhatCannotBe) {
  HostNumbers sut(claim("north", 1));
  sut.claim(claim("north", 2, 50, 9), kStart);
  sut.claim(claim("south", 0), kStart);
  sut.claim(claim("south", 0xffff), kStart);
  sut.claim(claim("a/b", 2), kStart);
  sut.claim(claim("", 2), kStart);
  EXPECT_TRUE(sut.others().empty());
  EXPECT_TRUE(sut.serves(kStart));
}

TEST(HostRanges, AreAsFewAsTheyCanBe) {
  EXPECT_THAT(ranges_of({}), IsEmpty());
  EXPECT_THAT(ranges_of({1, 2, 3, 7}),
              ElementsAre(HostRange{.first = 1, .last = 3}, HostRange{.first = 7, .last = 7}));
}

TEST(HostRanges, AreNeverMoreThanThereIsRoomFor) {
  std::vector<std::uint16_t> numbers;
  for (std::uint16_t i = 0; i <= kMaxHostRanges; ++i)
    numbers.push_back(static_cast<std::uint16_t>(10 * i + 1));
  numbers.push_back(65534);
  numbers.insert(numbers.begin() + 1, 4);  // the smallest gap
  const auto ranges = ranges_of(numbers);
  ASSERT_EQ(ranges.size(), kMaxHostRanges);
  EXPECT_EQ(ranges.front().first, 1);
  EXPECT_EQ(ranges.back(), (HostRange{.first = 65534, .last = 65534}));
  for (const std::uint16_t number : numbers) {
    EXPECT_TRUE(std::ranges::any_of(ranges, [&](const HostRange& hosts) {
      return number >= hosts.first && number <= hosts.last;
    })) << number;
  }
}

}  // namespace
}  // namespace plchost
