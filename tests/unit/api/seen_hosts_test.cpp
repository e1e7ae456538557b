#include "api/client/seen_hosts.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "api/dds/text.hpp"

namespace plchost {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr TimePoint kStart{std::chrono::seconds(1000)};

plc_Presence presence(const std::string& host, std::uint64_t epoch = 7) {
  plc_Presence presence{};
  dds::copy_text(presence.host, host);
  presence.epoch = epoch;
  return presence;
}

void fill(SeenHosts& sut, TimePoint now) {
  for (std::size_t i = 0; i < SeenHosts::kMost; ++i) sut.take(presence(fmt::format("host{}", i)), now);
}

TEST(SeenHosts, TellWhatIsNews) {
  SeenHosts sut;
  EXPECT_TRUE(sut.take(presence("a"), kStart));
  EXPECT_FALSE(sut.take(presence("a"), kStart));
  EXPECT_TRUE(sut.take(presence("a", 8), kStart));
  EXPECT_TRUE(sut.take(presence("a", 8), kStart + 2 * kServerGone)) << "it was gone";
}

TEST(SeenHosts, CountTheOlderServerOfAName) {
  SeenHosts sut;
  sut.take(presence("a", 8), kStart);
  EXPECT_FALSE(sut.take(presence("a", 7), kStart));
  EXPECT_EQ(sut.find("a")->server.value(), 8U);
  EXPECT_EQ(sut.find("a")->others, 1U);

  EXPECT_TRUE(sut.take(presence("a", 7), kStart + 2 * kServerGone));
  EXPECT_EQ(sut.find("a")->server.value(), 7U);
}

TEST(SeenHosts, TellOnceWhichServersHaveEnded) {
  SeenHosts sut;
  sut.take(presence("a", 7), kStart, 71);
  const TimePoint replaced = kStart + SeenHosts::kEnded / 2;
  sut.take(presence("a", 8), replaced, 81);
  EXPECT_THAT(sut.take_ended(replaced), IsEmpty()) << "not silent for long enough";
  EXPECT_THAT(sut.take_ended(kStart + SeenHosts::kEnded), ElementsAre(71));
  EXPECT_THAT(sut.take_ended(kStart + 2 * SeenHosts::kEnded), IsEmpty());
  EXPECT_THAT(sut.take_ended(kStart + std::chrono::hours(1)), IsEmpty()) << "the present one is only silent";
}

TEST(SeenHosts, DoNotTakeAServerForEndedThatShowsItsPresence) {
  SeenHosts sut;
  sut.take(presence("a", 7), kStart, 71);
  sut.take(presence("a", 8), kStart, 81);
  sut.take(presence("a", 7), kStart + SeenHosts::kEnded, 71);
  EXPECT_THAT(sut.take_ended(kStart + SeenHosts::kEnded), IsEmpty());
  const TimePoint later = kStart + 2 * kServerGone;
  sut.take(presence("a", 7), later, 71);
  EXPECT_THAT(sut.take_ended(later), ElementsAre(81)) << "the older one has outlasted it";
}

TEST(SeenHosts, AreBoundedWhoeverWritesNames) {
  SeenHosts sut;
  fill(sut, kStart);
  EXPECT_FALSE(sut.take(presence("new"), kStart + SeenHosts::kForgotten));
  EXPECT_EQ(sut.all().size(), SeenHosts::kMost);
  EXPECT_EQ(sut.find("new"), nullptr);
  EXPECT_FALSE(sut.take(presence("host7"), kStart)) << "those that are there go on";
  EXPECT_NE(sut.find("host7"), nullptr);
}

TEST(SeenHosts, ForgetWhoIsGoneForAMinuteWhenTheyAreFull) {
  SeenHosts sut;
  fill(sut, kStart);
  const TimePoint later = kStart + SeenHosts::kForgotten + kServerGone;
  sut.take(presence("host7"), later);
  EXPECT_TRUE(sut.take(presence("new"), later));
  EXPECT_EQ(sut.all().size(), 2U);
  EXPECT_NE(sut.find("host7"), nullptr);
  EXPECT_EQ(sut.find("host8"), nullptr);
}

}  // namespace
}  // namespace plchost
