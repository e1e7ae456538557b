#include "shm/block_driver/topology.hpp"

#include <initializer_list>

#include <gtest/gtest.h>

#include "shm/block_driver/duplicate_filter.hpp"

namespace plchost {
namespace {

NodeSet set_of(std::initializer_list<int> nodes) {
  NodeSet set;
  for (const int node : nodes) set.set(static_cast<std::size_t>(node) - 1);
  return set;
}

TEST(Topology, AllAreNeighboursThatWillTalkToAll) {
  Topology sut;
  for (const std::uint16_t node : {1, 5, 128}) sut.add(node, NodeSet().set(), true);
  const auto hops = sut.next_hops(5);
  EXPECT_EQ(hops[0], 1);
  EXPECT_EQ(hops[127], 128);
  EXPECT_EQ(hops[4], 0);
  EXPECT_EQ(hops[1], 0);  // nobody has it
  EXPECT_EQ(sut.children(5, 5), set_of({1, 128}));
  EXPECT_TRUE(sut.children(5, 1).none());
}

TEST(Topology, TwoAreNeighboursOnlyIfBothAreWilling) {
  Topology sut;
  sut.add(1, set_of({2}), true);
  sut.add(2, NodeSet().set(), true);
  sut.add(3, NodeSet().set(), true);
  EXPECT_TRUE(sut.neighbours(1, 2));
  EXPECT_FALSE(sut.neighbours(1, 3));
  EXPECT_FALSE(sut.neighbours(3, 1));
  EXPECT_EQ(sut.next_hops(1)[2], 2);
  EXPECT_EQ(sut.distances(1)[2], 2);
}

TEST(Topology, NoWayLeadsThroughANodeThatDoesNotForward) {
  Topology sut;
  sut.add(1, set_of({2}), true);
  sut.add(2, set_of({1, 3}), false);
  sut.add(3, set_of({2}), true);
  EXPECT_EQ(sut.next_hops(1)[1], 2);
  EXPECT_EQ(sut.next_hops(1)[2], 0);
}

TEST(Topology, ABlockForAllReachesEachNodeOfARingOnce) {
  Topology sut;
  constexpr int kNodes = 7;
  for (int node = 1; node <= kNodes; ++node) {
    sut.add(static_cast<std::uint16_t>(node), set_of({(node + kNodes - 2) % kNodes + 1, node % kNodes + 1}),
            true);
  }
  for (std::uint16_t root = 1; root <= kNodes; ++root) {
    std::size_t given = 0;
    NodeSet reached = set_of({root});
    for (std::uint16_t node = 1; node <= kNodes; ++node) {
      given += sut.children(root, node).count();
      reached |= sut.children(root, node);
    }
    EXPECT_EQ(given, kNodes - 1U);
    EXPECT_EQ(reached.count(), static_cast<std::size_t>(kNodes));
  }
}

TEST(Topology, AllOnTheWayAgreeOnIt) {
  Topology sut;  // 1 - 2 - 4 - 6, 1 - 3 - 5 - 6
  sut.add(1, set_of({2, 3}), true);
  sut.add(2, set_of({1, 4}), true);
  sut.add(3, set_of({1, 5}), true);
  sut.add(4, set_of({2, 6}), true);
  sut.add(5, set_of({3, 6}), true);
  sut.add(6, set_of({4, 5}), true);
  for (std::uint16_t from = 1; from <= 6; ++from) {
    for (std::uint16_t to = 1; to <= 6; ++to) {
      std::uint16_t at = from;
      int links = 0;
      for (; at != to && links < 7; ++links) at = sut.next_hops(at)[to - 1U];
      EXPECT_EQ(links, sut.distances(from)[to - 1U]);
    }
  }
}

BlockHeader numbered(std::uint32_t source, std::uint32_t sequence, std::uint32_t epoch = 1) {
  BlockHeader header;
  header.source = source;
  header.sequence = sequence;
  header.epoch = epoch;
  return header;
}

TEST(DuplicateFilter, PassesEachNumberOnceInAnyOrder) {
  DuplicateFilter sut;
  for (const std::uint32_t sequence : {0U, 1U, 5U, 3U, 2U, 4U, 60U}) {
    EXPECT_TRUE(sut.first_time(numbered(9, sequence))) << sequence;
    EXPECT_FALSE(sut.first_time(numbered(9, sequence))) << sequence;
  }
  EXPECT_TRUE(sut.first_time(numbered(8, 3)));
}

TEST(DuplicateFilter, TakesWhatIsOlderThanItsWindowForADuplicate) {
  DuplicateFilter sut;
  EXPECT_TRUE(sut.first_time(numbered(9, 1000)));
  EXPECT_TRUE(sut.first_time(numbered(9, 1000 - DuplicateFilter::kWindow + 1)));
  EXPECT_FALSE(sut.first_time(numbered(9, 1000 - DuplicateFilter::kWindow)));
  EXPECT_TRUE(sut.first_time(numbered(9, 5000)));
}

TEST(DuplicateFilter, GoesOnWhenTheNumbersWrap) {
  DuplicateFilter sut;
  for (std::uint32_t i = 0; i < 10; ++i) EXPECT_TRUE(sut.first_time(numbered(9, ~std::uint32_t{0} - 5 + i)));
  EXPECT_FALSE(sut.first_time(numbered(9, 2)));
}

TEST(DuplicateFilter, ASourceThatBeganAnewAndAnotherPriorityCountForThemselves) {
  DuplicateFilter sut;
  EXPECT_TRUE(sut.first_time(numbered(9, 500)));
  EXPECT_TRUE(sut.first_time(numbered(9, 0, 2)));
  BlockHeader urgent = numbered(9, 0, 2);
  urgent.priority = 1;
  EXPECT_TRUE(sut.first_time(urgent));
  EXPECT_FALSE(sut.first_time(urgent));
}

TEST(DuplicateFilter, ForgetsTheSourceThatWasSilentForLongest) {
  DuplicateFilter sut;
  for (std::uint32_t source = 1; source <= DuplicateFilter::kSources; ++source) {
    EXPECT_TRUE(sut.first_time(numbered(source, 1)));
  }
  EXPECT_TRUE(sut.first_time(numbered(1, 2)));
  EXPECT_TRUE(sut.first_time(numbered(1000, 1)));
  EXPECT_FALSE(sut.first_time(numbered(1, 1)));
  EXPECT_TRUE(sut.first_time(numbered(2, 1)));
}

}  // namespace
}  // namespace plchost
