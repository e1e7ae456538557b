#include "api/gateway/block_sample.hpp"

#include <array>
#include <cstring>
#include <functional>
#include <string>

#include <gtest/gtest.h>

namespace plchost {
namespace {

constexpr std::uint16_t kSender = 2;
constexpr std::uint16_t kOwn = 1;

BlockHeader header_for(NodeAddress destination) {
  BlockHeader header;
  header.destination = destination.number();
  header.source = NodeAddress{.host = kSender, .node = 7}.number();
  header.channel = 0x12345678;
  header.correlation = 99;
  header.sequence = 5;
  header.epoch = 3;
  header.kind = static_cast<std::uint8_t>(BlockKind::request);
  header.priority = static_cast<std::uint8_t>(BlockPriority::high);
  header.hosts = 1;
  return header;
}

constexpr std::array<std::byte, 3> kContents{std::byte{1}, std::byte{2}, std::byte{3}};

plc_Block good_sample() {
  return block_sample(header_for({.host = kOwn, .node = 9}), kContents, 17);
}

TEST(BlockSample, SaysAllThatTheHeaderSaid) {
  const BlockHeader before = header_for({.host = kOwn, .node = 9});
  const plc_Block sample = block_sample(before, kContents, 17);
  EXPECT_EQ(sample.sequence_number, 17U);
  const auto header = block_header(sample, kSender, kOwn);
  ASSERT_TRUE(header);
  BlockHeader expected = before;
  expected.size = kContents.size();
  EXPECT_EQ(*header, expected);
  const auto contents = block_contents(sample);
  ASSERT_EQ(contents.size(), kContents.size());
  EXPECT_EQ(std::memcmp(contents.data(), kContents.data(), contents.size()), 0);
}

TEST(BlockSample, ForAllNodesOfThisHostOrOfAllHostsIsForThisHost) {
  for (const std::uint16_t host : {kOwn, NodeAddress::kAllHosts}) {
    const plc_Block sample =
        block_sample(header_for({.host = host, .node = NodeAddress::kAllNodes}), kContents, 1);
    EXPECT_TRUE(block_header(sample, kSender, kOwn)) << host;
  }
}

struct WrongSample {
  std::string name;
  std::function<void(plc_Block&)> change;
};

class BlockSampleRefuses : public testing::TestWithParam<WrongSample> {};

TEST_P(BlockSampleRefuses, WhatCannotBe) {
  plc_Block sample = good_sample();
  ASSERT_TRUE(block_header(sample, kSender, kOwn));
  GetParam().change(sample);
  EXPECT_FALSE(block_header(sample, kSender, kOwn));
}

INSTANTIATE_TEST_SUITE_P(
    Fields, BlockSampleRefuses,
    testing::Values(
        WrongSample{"source_of_another_host", [](plc_Block& s) { s.source_host = 3; }},
        WrongSample{"source_of_this_host", [](plc_Block& s) { s.source_host = kOwn; }},
        WrongSample{"source_without_a_host", [](plc_Block& s) { s.source_host = 0; }},
        WrongSample{"source_of_no_node", [](plc_Block& s) { s.source_node = 0; }},
        WrongSample{"source_of_too_high_a_node", [](plc_Block& s) { s.source_node = kMaxNodes + 1; }},
        WrongSample{"source_of_all_nodes", [](plc_Block& s) { s.source_node = NodeAddress::kAllNodes; }},
        WrongSample{"for_another_host", [](plc_Block& s) { s.destination_host = 3; }},
        WrongSample{"for_no_host", [](plc_Block& s) { s.destination_host = 0; }},
        WrongSample{"for_no_node", [](plc_Block& s) { s.destination_node = 0; }},
        WrongSample{"for_too_high_a_node", [](plc_Block& s) { s.destination_node = kMaxNodes + 1; }},
        WrongSample{"for_one_node_of_all_hosts",
                    [](plc_Block& s) { s.destination_host = NodeAddress::kAllHosts; }},
        WrongSample{"no_channel", [](plc_Block& s) { s.channel = 0; }},
        WrongSample{"no_such_kind", [](plc_Block& s) { s.kind = kBlockKinds; }},
        WrongSample{"no_such_priority", [](plc_Block& s) { s.priority = kBlockPriorities; }},
        WrongSample{"round_and_round", [](plc_Block& s) { s.hosts = kMaxHops; }},
        WrongSample{"too_large", [](plc_Block& s) { s.contents._length = kMaxBlockSize + 1; }}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace plchost
