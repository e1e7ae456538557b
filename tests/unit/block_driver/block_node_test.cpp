#include "shm/block_driver/block_node.hpp"

#include "tests/unit/block_driver/node_fixture.hpp"

namespace plchost {
namespace {

class BlockNodeTest : public BlockNodes {
 protected:
  /// The link as a stranger would map it; empty: there is none.
  [[nodiscard]] MemoryFile link(const TestNode& from, const TestNode& to) const {
    const std::string name = link_name(pool(), "blocks", from.address().node, to.address().node);
    return MemoryFile::open(name, sizeof(LinkLayout), MemoryFile::Access::read_write).value_or(MemoryFile());
  }
  bool arrives_again(TestNode& from, TestNode& to) {
    BlockChannel sender = from.channel();
    BlockChannel receiver = to.channel();
    for (int i = 0; i < 100; ++i) {
      (void)sender.send(to.address(), bytes_of("again"));
      pass(std::chrono::milliseconds(100), from, to);
      if (to.next(receiver) == "again") return true;
    }
    return false;
  }
  /// By a node "a" that goes then.
  void send_last_words(TestNode& to, NodeAddress& from) {
    TestNode a = join("a");
    from = a.address();
    connect(a, to);
    BlockChannel sender = a.channel();
    ASSERT_EQ(sender.send(to.address(), bytes_of("last words")), SendResult::sent);
  }
};

TEST_F(BlockNodeTest, TwoNodesTalkToEachOtherInTheirCycles) {
  TestNode a = join("a");
  TestNode b = join("b");
  BlockChannel to_b = a.channel();
  BlockChannel to_a = b.channel();
  connect(a, b);
  connect(b, a);
  ASSERT_EQ(to_b.send(b.address(), bytes_of("hello")), SendResult::sent);
  EXPECT_EQ(b.next(to_a), "hello");
  EXPECT_EQ(b.received.from, a.address());
  ASSERT_EQ(to_a.send(b.received.from, bytes_of("and back")), SendResult::sent);
  EXPECT_EQ(a.next(to_b), "and back");
  EXPECT_EQ(a.next(to_b), "nothing");
}

TEST_F(BlockNodeTest, FindsNodesByNameAndMakesTheLinkOnDemand) {
  TestNode a = join("a");
  TestNode b = join("b");
  settle(a, b);
  EXPECT_EQ(a.node->find("b"), b.address());
  EXPECT_EQ(a.node->find("nobody"), NodeAddress{});
  settle(a, b);
  BlockChannel sut = a.channel();
  EXPECT_EQ(sut.send(b.address(), {}), SendResult::sent);
}

TEST_F(BlockNodeTest, ANodeTalksToItself) {
  TestNode a = join("a");
  BlockChannel sut = a.channel();
  ASSERT_EQ(sut.send(a.address(), bytes_of("me")), SendResult::sent);
  EXPECT_EQ(a.next(sut), "me");
}

TEST_F(BlockNodeTest, BlocksOfAllSizesArrive) {
  TestNode a = join("a");
  TestNode b = join("b");
  connect(a, b);
  BlockChannel from = a.channel();
  BlockChannel to = b.channel();
  for (const std::size_t size : {0UL, 1UL, 64UL, 512UL, 10'000UL, kMaxBlockSize}) {
    const std::string text(size, static_cast<char>('a' + size % 26));
    ASSERT_EQ(from.send(b.address(), bytes_of(text)), SendResult::sent);
    EXPECT_EQ(b.next(to), text);
  }
  EXPECT_EQ(from.send(b.address(), std::vector<std::byte>(kMaxBlockSize + 1)), SendResult::invalid);
}

TEST_F(BlockNodeTest, WhatCannotBeAnAddressIsRefusedAndWhoIsNotThereIsUnreachable) {
  TestNode a = join("a");
  BlockChannel sut = a.channel();
  EXPECT_EQ(sut.send({.host = 0, .node = 0}, {}), SendResult::invalid);
  EXPECT_EQ(sut.send({.host = 0, .node = kMaxNodes + 1}, {}), SendResult::invalid);
  EXPECT_EQ(sut.send({.host = 0, .node = kMaxNodes}, {}), SendResult::unreachable);
  EXPECT_EQ(sut.send({.host = 7, .node = 1}, {}), SendResult::unreachable);
}

TEST_F(BlockNodeTest, TheHigherPriorityIsReceivedFirst) {
  TestNode a = join("a");
  TestNode b = join("b");
  connect(a, b);
  BlockChannel from = a.channel();
  BlockChannel to = b.channel();
  using enum BlockPriority;
  for (const BlockPriority priority : {low, normal, high, emergency, low, normal}) {
    ASSERT_EQ(from.send(b.address(), bytes_of(to_string(priority)), priority), SendResult::sent);
  }
  for (const BlockPriority priority : {emergency, high, normal, normal, low, low}) {
    EXPECT_EQ(b.next(to), to_string(priority));
    EXPECT_EQ(b.received.priority, priority);
  }
}

TEST_F(BlockNodeTest, AFullQueueIsCongestionOfItsPriorityOnlyAndIsCounted) {
  TestNode a = join("a");
  TestNode b = join("b");
  connect(a, b);
  BlockChannel from = a.channel();
  BlockChannel to = b.channel();
  std::uint32_t sent = 0;
  while (from.send(b.address(), bytes_of("x")) == SendResult::sent) ++sent;
  EXPECT_EQ(sent, kMinRingSlots);
  EXPECT_EQ(from.send(b.address(), bytes_of("x")), SendResult::congested);
  EXPECT_EQ(from.send(b.address(), bytes_of("urgent"), BlockPriority::high), SendResult::sent);
  EXPECT_EQ(b.next(to), "urgent");
  for (std::uint32_t i = 0; i < sent; ++i) ASSERT_EQ(b.next(to), "x");
  EXPECT_EQ(from.send(b.address(), bytes_of("again")), SendResult::sent);
  const auto link = LinkMemory::open_to_read(link_name(pool(), "blocks", a.address().node, b.address().node));
  ASSERT_TRUE(link);
  EXPECT_EQ(link->layout().congested[static_cast<std::size_t>(BlockPriority::normal)].load(), 2U);
}

TEST_F(BlockNodeTest, ChannelsOfOneNodeDoNotSeeEachOthersBlocks) {
  TestNode a = join("a");
  TestNode b = join("b");
  connect(a, b);
  BlockChannel one = a.channel("one");
  BlockChannel two = a.channel("two");
  BlockChannel at_one = b.channel("one");
  BlockChannel at_two = b.channel("two");
  ASSERT_EQ(one.send(b.address(), bytes_of("1")), SendResult::sent);
  ASSERT_EQ(two.send(b.address(), bytes_of("2")), SendResult::sent);
  EXPECT_EQ(b.next(at_two), "2");
  EXPECT_EQ(b.next(at_two), "nothing");
  EXPECT_EQ(b.next(at_one), "1");
}

TEST_F(BlockNodeTest, ChannelNamesHaveABound) {
  TestNode a = join("a");
  EXPECT_TRUE(BlockChannel::open(*a.node, std::string(kMaxChannelName, 'c')));
  EXPECT_FALSE(BlockChannel::open(*a.node, std::string(kMaxChannelName + 1, 'c')));
  EXPECT_FALSE(BlockChannel::open(*a.node, ""));
}

TEST_F(BlockNodeTest, TwoNamesOfTheSameNumberCannotBothBeOpen) {
  TestNode a = join("a");
  // 32 bits: a collision is soon found among names that are counted up.
  std::map<std::uint32_t, std::string> names;
  std::string first;
  std::string second;
  for (int i = 0; second.empty(); ++i) {
    std::string name = "channel-" + std::to_string(i * 7919) + "-" + std::to_string(i);
    const auto [known, is_new] = names.try_emplace(channel_number(name), name);
    if (is_new) continue;
    first = known->second;
    second = name;
  }
  ASSERT_TRUE(BlockChannel::open(*a.node, first));
  EXPECT_TRUE(BlockChannel::open(*a.node, first));
  EXPECT_EQ(BlockChannel::open(*a.node, second).error().code, ErrorCode::already_exists);
}

TEST_F(BlockNodeTest, ARequestGetsItsReply) {
  TestNode a = join("a");
  TestNode b = join("b");
  connect(a, b);
  connect(b, a);
  BlockChannel client = a.channel("service");
  BlockChannel server = b.channel("service");
  std::uint32_t first = 0;
  std::uint32_t second = 0;
  ASSERT_EQ(client.request(b.address(), bytes_of("one"), first, BlockPriority::high), SendResult::sent);
  ASSERT_EQ(client.request(b.address(), bytes_of("two"), second), SendResult::sent);
  EXPECT_NE(first, second);
  for (const std::string text : {"one", "two"}) {
    ASSERT_EQ(b.next(server), text);
    ASSERT_EQ(b.received.kind, BlockKind::request);
    ASSERT_EQ(server.reply(b.received, bytes_of("re: " + text)), SendResult::sent);
  }
  EXPECT_EQ(a.next(client), "re: one");
  EXPECT_EQ(a.received.kind, BlockKind::reply);
  EXPECT_EQ(a.received.correlation, first);
  EXPECT_EQ(a.next(client), "re: two");
  EXPECT_EQ(a.received.correlation, second);
}

TEST_F(BlockNodeTest, WhatNobodyTakesIsDroppedAfterTheHoldTimeAndFreesTheQueue) {
  TestNode a = join("a");
  TestNode b = join("b");
  connect(a, b);
  BlockChannel dead = a.channel("dead");
  BlockChannel alive = a.channel("alive");
  BlockChannel receiver = b.channel("alive");
  while (dead.send(b.address(), bytes_of("x")) == SendResult::sent) {
  }
  ASSERT_EQ(alive.send(b.address(), bytes_of("y")), SendResult::congested);
  pass(std::chrono::milliseconds(500), a, b);
  ASSERT_EQ(alive.send(b.address(), bytes_of("y")), SendResult::congested);
  pass(std::chrono::milliseconds(1500), a, b);
  EXPECT_EQ(alive.send(b.address(), bytes_of("y")), SendResult::sent);
  EXPECT_EQ(b.next(receiver), "y");
  EXPECT_EQ(counters(b).expired.load(), kMinRingSlots);
}

TEST_F(BlockNodeTest, ABufferThatIsTooSmallTellsTheSizeAndTheBlockWaits) {
  TestNode a = join("a");
  BlockChannel sut = a.channel();
  ASSERT_EQ(sut.send(a.address(), bytes_of("12345")), SendResult::sent);
  std::vector<std::byte> small(4);
  Received received;
  EXPECT_EQ(sut.receive(small, received), TakeResult::too_small);
  EXPECT_EQ(received.size, 5U);
  EXPECT_EQ(a.next(sut), "12345");
}

TEST_F(BlockNodeTest, ANodeThatWentAndCameBackIsReachedByTheSameAddress) {
  TestNode a = join("a");
  BlockChannel from = a.channel();
  NodeAddress address;
  {
    TestNode b = join("b");
    address = b.address();
    connect(a, b);
    ASSERT_EQ(from.send(address, bytes_of("to the first")), SendResult::sent);
  }
  settle(a);
  EXPECT_EQ(from.send(address, {}), SendResult::unreachable);
  TestNode b = join("b");
  ASSERT_EQ(b.address(), address);
  settle(a, b);
  EXPECT_EQ(from.send(address, {}), SendResult::connecting);
  settle(a, b);
  ASSERT_EQ(from.send(address, bytes_of("to the second")), SendResult::sent);
  BlockChannel to = b.channel();
  EXPECT_EQ(b.next(to), "to the second");
}

TEST_F(BlockNodeTest, WhatANodeSentBeforeItWentIsStillReceived) {
  TestNode b = join("b");
  BlockChannel to = b.channel();
  NodeAddress gone;
  ASSERT_NO_FATAL_FAILURE(send_last_words(b, gone));
  settle(b);
  EXPECT_EQ(b.next(to), "last words");
}

// No time passes, so no audit looks for links that nobody tells of.
TEST_F(BlockNodeTest, ALinkThatHadToWaitForTheRestOfTheLastOneIsOpenedWhenThatIsTaken) {
  TestNode b = join("b");
  BlockChannel to = b.channel();
  NodeAddress address;
  ASSERT_NO_FATAL_FAILURE(send_last_words(b, address));
  TestNode a = join("a");
  ASSERT_EQ(a.address(), address);
  connect(a, b);
  BlockChannel from = a.channel();
  ASSERT_EQ(from.send(b.address(), bytes_of("first words")), SendResult::sent);
  settle(a, b);
  EXPECT_EQ(b.next(to), "last words");
  settle(a, b);
  EXPECT_EQ(b.next(to), "first words");
}

TEST_F(BlockNodeTest, ALinkThatAStrangerSpoiltIsMadeAnew) {
  TestNode a = join("a");
  TestNode b = join("b");
  connect(a, b);
  const MemoryFile memory = link(a, b);
  ASSERT_TRUE(memory);
  std::ranges::fill(memory.bytes(), std::byte{0x5a});
  EXPECT_TRUE(arrives_again(a, b));
}

TEST_F(BlockNodeTest, BlocksThatWaitInALinkThatIsMadeAnewAreCounted) {
  TestNode a = join("a");
  TestNode b = join("b");
  connect(a, b);
  BlockChannel lost = a.channel("lost");
  BlockChannel from = a.channel("alive");
  BlockChannel to = b.channel("alive");
  const MemoryFile memory = link(a, b);
  ASSERT_TRUE(memory);
  // The writer looks at the head when the ring seems full; a stranger has written there.
  reinterpret_cast<LinkLayout*>(memory.bytes().data())->heads[std::size_t(BlockPriority::normal)] = 1UL
                                                                                                    << 60U;
  std::uint64_t sent = 0;
  while (lost.send(b.address(), bytes_of("x")) == SendResult::sent) ++sent;
  ASSERT_EQ(sent, kMinRingSlots);
  bool arrived = false;
  for (int i = 0; i < 10 && !arrived; ++i) {
    pass(std::chrono::milliseconds(10), a, b);
    (void)from.send(b.address(), bytes_of("again"));
    arrived = b.next(to) == "again";
  }
  EXPECT_TRUE(arrived);
  EXPECT_EQ(counters(b).expired.load(), sent);
}

// The receiver's audit opens a link as soon as it has its name, which is before the sender tells of it.
TEST_F(BlockNodeTest, ALinkThatIsOpenWhenItIsToldOfLosesNothing) {
  TestNode a = join("a");
  TestNode b = join("b");
  connect(a, b);
  BlockChannel from = a.channel();
  BlockChannel to = b.channel();
  const auto send_all = [&] {
    for (std::uint32_t i = 0; i < 3 * kMinRingSlots; ++i) {
      const std::string text = std::to_string(i);
      ASSERT_EQ(from.send(b.address(), bytes_of(text)), SendResult::sent) << text;
      ASSERT_EQ(b.next(to), text);
    }
  };
  send_all();
  ASSERT_EQ(from.send(b.address(), bytes_of("waits")), SendResult::sent);
  NodeDirectory directory = NodeDirectory::open(pool()).value();
  const std::uint16_t bit = a.address().node - 1U;
  directory.slot(b.address().node).incoming[bit / 64].fetch_or(std::uint64_t{1} << bit % 64);
  settle(a, b);
  EXPECT_EQ(b.next(to), "waits");
  send_all();
  EXPECT_EQ(counters(b).expired.load(), 0U);
}

TEST_F(BlockNodeTest, ALinkWhoseBlocksAStrangerWipedOutIsMadeAnew) {
  TestNode a = join("a");
  TestNode b = join("b");
  connect(a, b);
  BlockChannel from = a.channel();
  const MemoryFile memory = link(a, b);
  ASSERT_TRUE(memory);
  while (from.send(b.address(), bytes_of("x")) == SendResult::sent) {
  }
  std::ranges::fill(memory.bytes().subspan(sizeof(LinkLayout)), std::byte{});
  EXPECT_TRUE(arrives_again(a, b));
}

}  // namespace
}  // namespace plchost
