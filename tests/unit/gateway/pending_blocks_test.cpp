#include "api/gateway/pending_blocks.hpp"

#include <map>
#include <string>

#include <gmock/gmock.h>

namespace plchost {
namespace {

using testing::ElementsAre;

constexpr TimePoint kStart = TimePoint(std::chrono::hours(1));
constexpr Duration kHold = std::chrono::seconds(1);
constexpr Duration kLittle = std::chrono::milliseconds(1);

class PendingBlocksTest : public testing::Test {
 protected:
  static BlockHeader header_for(std::uint16_t node, std::uint32_t number, std::uint8_t priority = 2) {
    BlockHeader header;
    header.destination = NodeAddress{.host = 1, .node = node}.number();
    header.correlation = number;
    header.priority = priority;
    return header;
  }
  void take(std::uint16_t node, std::uint32_t number, std::uint8_t priority = 2, TimePoint now = kStart) {
    sut_.take(header_for(node, number, priority), contents_, now);
  }

  std::map<std::uint16_t, SendResult> results_;  // of each node; else it is sent
  std::vector<std::uint32_t> sent_;
  std::vector<std::byte> contents_{10};
  NodeCounters counters_{};
  PendingBlocks sut_{[this](const BlockHeader& header, std::span<const std::byte>) {
                       const auto node = NodeAddress::from_number(header.destination).node;
                       const auto found = results_.find(node);
                       if (found != results_.end()) return found->second;
                       sent_.push_back(header.correlation);
                       return SendResult::sent;
                     },
                     kHold, counters_};
};

TEST_F(PendingBlocksTest, WhatCanGoInDoesAtOnce) {
  take(5, 1);
  EXPECT_THAT(sent_, ElementsAre(1));
  EXPECT_TRUE(sut_.empty());
}

TEST_F(PendingBlocksTest, WhatWaitsGoesInInOrderAndHoldsUpNoOtherNode) {
  results_[5] = SendResult::connecting;
  take(5, 1);
  take(6, 10);
  results_.clear();
  take(5, 2);
  EXPECT_THAT(sent_, ElementsAre(10)) << "it does not overtake the first";
  take(5, 3, 0);
  EXPECT_THAT(sent_, ElementsAre(10, 3)) << "one of another priority does";
  sut_.retry(kStart);
  EXPECT_THAT(sent_, ElementsAre(10, 3, 1, 2));
  EXPECT_TRUE(sut_.empty());
}

TEST_F(PendingBlocksTest, WhatWaitsTooLongIsDroppedAndCounted) {
  results_[5] = SendResult::congested;
  take(5, 1);
  take(5, 2, 2, kStart + kHold / 2);
  sut_.retry(kStart + kHold);
  EXPECT_EQ(counters_.expired.load(), 0U);
  sut_.retry(kStart + kHold + kLittle);
  EXPECT_EQ(counters_.expired.load(), 1U);
  results_.clear();
  sut_.retry(kStart + kHold + kLittle);
  EXPECT_THAT(sent_, ElementsAre(2));
}

TEST_F(PendingBlocksTest, WhatCannotGoInIsDroppedAndCounted) {
  results_[5] = SendResult::unreachable;
  take(5, 1);
  EXPECT_EQ(counters_.no_route.load(), 1U);
  results_[5] = SendResult::invalid;
  take(5, 2);
  EXPECT_EQ(counters_.refused.load(), 1U);
  EXPECT_TRUE(sut_.empty());
}

TEST_F(PendingBlocksTest, ANodeForWhichManyWaitIsFullUntilTheyAreGone) {
  results_[kMaxNodes] = SendResult::congested;
  for (std::uint32_t i = 0; i < PendingBlocks::kFull; ++i) {
    EXPECT_TRUE(sut_.full().none()) << i;
    take(kMaxNodes, i);
  }
  EXPECT_TRUE(sut_.full()[kMaxNodes - 1]);
  EXPECT_EQ(sut_.full().count(), 1U);
  results_.clear();
  sut_.retry(kStart);
  EXPECT_TRUE(sut_.full().none());
}

TEST_F(PendingBlocksTest, BlocksForAllNodesMakeNoNodeFull) {
  results_[NodeAddress::kAllNodes] = SendResult::congested;
  for (std::uint32_t i = 0; i < 2 * PendingBlocks::kFull; ++i) take(NodeAddress::kAllNodes, i);
  EXPECT_TRUE(sut_.full().none());
}

TEST_F(PendingBlocksTest, HoldsNoMoreThanItsBounds) {
  results_[5] = SendResult::congested;
  for (std::uint32_t i = 0; i < PendingBlocks::kMostBlocks; ++i) take(5, i);
  EXPECT_EQ(counters_.congested.load(), 0U);
  take(5, 0);
  EXPECT_EQ(counters_.congested.load(), 1U);
  results_[6] = SendResult::congested;
  contents_.resize(PendingBlocks::kMostBytes - 10 * PendingBlocks::kMostBlocks);
  take(6, 1);
  EXPECT_EQ(counters_.congested.load(), 1U);
  contents_.resize(1);
  take(6, 2);
  EXPECT_EQ(counters_.congested.load(), 2U);
}

}  // namespace
}  // namespace plchost
