#include "api/dds/gate/host_mark.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "api/dds/gate/submessage.hpp"

namespace plchost::dds::host_mark_test {  // packet_gate_test.cpp has such functions, too
namespace {

using Bytes = std::vector<std::byte>;

constexpr HostMark kOwn{.name = "cell1", .sends_blocks = true};

void put(Bytes& bytes, std::uint32_t number, std::size_t size, bool little) {
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t place = little ? i : size - 1 - i;
    bytes.push_back(static_cast<std::byte>(number >> (8 * place) & 0xffU));
  }
}

void append(Bytes& bytes, const Bytes& more) {
  bytes.insert(bytes.end(), more.begin(), more.end());
}

/// A parameter list of a participant, with a parameter before its user data.
Bytes list_with(std::string_view words, bool little) {
  Bytes list{std::byte{0}, std::byte{little ? std::uint8_t{3} : std::uint8_t{2}}, std::byte{0}, std::byte{0}};
  put(list, 0x0015, 2, little);
  put(list, 4, 2, little);
  put(list, 2, 4, little);
  const std::size_t filled = (words.size() + 3) / 4 * 4;
  put(list, 0x002c, 2, little);
  put(list, static_cast<std::uint32_t>(4 + filled), 2, little);
  put(list, static_cast<std::uint32_t>(words.size()), 4, little);
  for (const char c : words) list.push_back(static_cast<std::byte>(c));
  list.resize(list.size() + filled - words.size());
  put(list, 1, 2, little);
  put(list, 0, 2, little);
  return list;
}

/// A sample of that writer.
Bytes sample(const EntityId& writer, const Bytes& contents, bool little) {
  Bytes made{std::byte{submessage_kind::kData},
             std::byte{static_cast<std::uint8_t>(kDataHasContents | (little ? kLittleEndian : 0))}};
  put(made, static_cast<std::uint32_t>(20 + contents.size()), 2, little);
  put(made, 0, 2, little);
  put(made, kDataFields, 2, little);
  put(made, 0, 4, little);
  for (const std::uint8_t octet : writer) made.push_back(std::byte{octet});
  put(made, 0, 4, little);
  put(made, 1, 4, little);
  append(made, contents);
  return made;
}

Bytes announcement(std::string_view words, bool little = true) {
  return sample(kParticipantWriter, list_with(words, little), little);
}

Bytes datagram(const std::vector<Bytes>& parts) {
  constexpr std::string_view kBegin("RTPS\2\1\1\20abcdefghijkl", kRtpsHeader);
  Bytes made;
  for (const char c : kBegin) made.push_back(static_cast<std::byte>(c));
  const Bytes timestamp{std::byte{submessage_kind::kInfoTimestamp}, std::byte{1}, std::byte{8}, std::byte{0}};
  append(made, timestamp);
  made.resize(made.size() + 8);
  for (const Bytes& part : parts) append(made, part);
  return made;
}

/// Whether the announcement reaches Cyclone as it was sent.
bool passes(std::string_view words, const HostMark& own = kOwn, bool little = true) {
  Bytes sut = datagram({announcement(words, little)});
  const Bytes before = sut;
  const std::size_t size = take_out_other_hosts(sut, own);
  if (size == 0) return false;
  EXPECT_EQ(size, before.size());
  EXPECT_EQ(sut, before);
  return true;
}

TEST(HostMark, IsReadAsItWasWritten) {
  for (const bool sends_blocks : {false, true}) {
    const std::string words = words_of({.name = "cell.2", .sends_blocks = sends_blocks});
    const auto read = host_mark_of(words);
    ASSERT_TRUE(read) << words;
    EXPECT_EQ(read->name, "cell.2");
    EXPECT_EQ(read->sends_blocks, sends_blocks);
  }
}

TEST(HostMark, IsNoneOfClientsAndLaterVersions) {
  for (const std::string_view words : {"", "plchost: plcctl 1, user 0, on cell2", "plchost host: ",
                                       "plchost host:  with blocks", "plchost host: cell2 with clocks"})
    EXPECT_FALSE(host_mark_of(words)) << words;
}

TEST(HostMark, ConcernsAHostOfItsNameAndOneForBlocksOfEach) {
  constexpr HostMark kCell1{.name = "cell1"};
  constexpr HostMark kCell2{.name = "cell2"};
  constexpr HostMark kBlocks1{.name = "cell1", .sends_blocks = true};
  constexpr HostMark kBlocks2{.name = "cell2", .sends_blocks = true};
  constexpr std::array kAll{kCell1, kCell2, kBlocks1, kBlocks2};
  for (const HostMark& one : kAll) {
    for (const HostMark& other : kAll)
      EXPECT_EQ(concern_each_other(one, other), concern_each_other(other, one));
  }
  EXPECT_TRUE(concern_each_other(kCell1, kBlocks1));
  EXPECT_TRUE(concern_each_other(kBlocks1, kBlocks2));
  EXPECT_FALSE(concern_each_other(kCell1, kCell2));
  EXPECT_FALSE(concern_each_other(kBlocks1, kCell2));
}

TEST(OtherHosts, AreTakenOut) {
  for (const bool little : {false, true}) {
    EXPECT_FALSE(passes("plchost host: cell2", kOwn, little));
    EXPECT_TRUE(passes("plchost host: cell1", kOwn, little));
    EXPECT_TRUE(passes("plchost host: cell2 with blocks", kOwn, little));
    EXPECT_FALSE(passes("plchost host: cell2 with blocks", {.name = "cell1"}, little));
  }
}

TEST(OtherHosts, AreNoClientsAndNoHostsWithoutMark) {
  EXPECT_TRUE(passes(""));
  EXPECT_TRUE(passes("plchost: plcctl 1, user 0, on cell2"));
  EXPECT_TRUE(passes("something of another vendor"));
}

TEST(OtherHosts, LeaveTheRestOfADatagram) {
  const Bytes client = announcement("plchost: plcctl 1, user 0, on cell2");
  const Bytes host = announcement("plchost host: cell2");
  Bytes sut = datagram({client, host, client});
  Bytes expected = sut;
  EXPECT_EQ(take_out_other_hosts(sut, kOwn), expected.size());
  const std::size_t at = expected.size() - client.size() - host.size();
  expected[at] = std::byte{submessage_kind::kPad};
  expected[at + 1] = std::byte{kLittleEndian};
  EXPECT_EQ(sut, expected);
}

TEST(OtherHosts, AreToldByTheirAnnouncementsOnly) {
  const Bytes words = list_with("plchost host: cell2", true);
  for (const EntityId& writer : {kPublicationsWriter, kLivelinessWriter, EntityId{0, 0, 1, 3}}) {
    Bytes sut = datagram({sample(writer, words, true)});
    const Bytes before = sut;
    EXPECT_EQ(take_out_other_hosts(sut, kOwn), before.size());
    EXPECT_EQ(sut, before);
  }
}

TEST(OtherHosts, AreReadWithinTheDatagram) {
  const Bytes whole = datagram({announcement("plchost host: cell2"), announcement("plchost host: cell3")});
  std::mt19937 random(14);
  constexpr int kRounds = 20'000;
  for (int round = 0; round < kRounds; ++round) {
    // Of its own size, so that the address sanitizer sees a byte too far.
    Bytes sut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(random() % (whole.size() + 1)));
    for (std::uint32_t left = random() % 4; left > 0 && !sut.empty(); --left)
      sut[random() % sut.size()] = static_cast<std::byte>(random());
    const std::size_t size = take_out_other_hosts(sut, kOwn);
    ASSERT_TRUE(size == 0 || size == sut.size());
  }
}

}  // namespace
}  // namespace plchost::dds::host_mark_test
