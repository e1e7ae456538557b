#include "shm/block_driver/block_router.hpp"

#include <thread>

#include "tests/unit/block_driver/node_fixture.hpp"

namespace plchost {
namespace {

using BlockRouterTest = BlockNodes;

constexpr NodeAddress kAll{.host = 0, .node = NodeAddress::kAllNodes};

TEST_F(BlockRouterTest, ABlockGoesThroughTheNodeThatLiesBetween) {
  TestNode a = join("a", {"b"});
  TestNode b = join("b");
  TestNode c = join("c", {"b"});
  connect(a, c, b);
  BlockChannel from = a.channel();
  BlockChannel to = c.channel();
  for (const std::string text : {"one", "two", "three"}) {
    ASSERT_EQ(from.send(c.address(), bytes_of(text)), SendResult::sent);
  }
  settle(a, b, c);
  for (const std::string text : {"one", "two", "three"}) EXPECT_EQ(c.next(to), text);
  EXPECT_EQ(c.received.from, a.address());
  EXPECT_EQ(counters(b).forwarded.load(), 3U);
  ASSERT_EQ(to.send(c.received.from, bytes_of("back")), SendResult::connecting);
  settle(a, b, c);
  ASSERT_EQ(to.send(c.received.from, bytes_of("back")), SendResult::sent);
  settle(a, b, c);
  EXPECT_EQ(a.next(from), "back");
}

TEST_F(BlockRouterTest, TheLargestBlockGoesThroughTheNodeBetweenUnchanged) {
  TestNode a = join("a", {"b"});
  TestNode b = join("b");
  TestNode c = join("c", {"b"});
  connect(a, c, b);
  BlockChannel from = a.channel();
  BlockChannel to = c.channel();
  std::string text(kMaxBlockSize, 'x');
  for (std::size_t i = 0; i < text.size(); ++i) text[i] = static_cast<char>('a' + i * i % 25);
  ASSERT_EQ(from.send(c.address(), bytes_of(text)), SendResult::sent);
  settle(a, b, c);
  EXPECT_EQ(c.next(to), text);
}

TEST_F(BlockRouterTest, WithoutAWayBetweenItIsUnreachableUntilThereIsOne) {
  TestNode a = join("a", {"b"});
  TestNode c = join("c", {"b"});
  settle(a, c);
  BlockChannel from = a.channel();
  EXPECT_EQ(from.send(c.address(), {}), SendResult::unreachable);
  TestNode b = join("b");
  settle(a, b, c);
  EXPECT_EQ(from.send(c.address(), {}), SendResult::connecting);
}

TEST_F(BlockRouterTest, ANodeThatDoesNotForwardIsNoWay) {
  TestNode a = join("a", {"b"});
  NodeOptions options_of_b = options("b");
  options_of_b.entry.forwards = false;
  TestNode b = join(options_of_b);
  TestNode c = join("c", {"b"});
  settle(a, b, c);
  BlockChannel from = a.channel();
  EXPECT_EQ(from.send(c.address(), {}), SendResult::unreachable);
  EXPECT_EQ(from.send(b.address(), {}), SendResult::connecting);
}

TEST_F(BlockRouterTest, ABlockThatWouldGoFurtherThanTheHopLimitIsDroppedAndCounted) {
  TestNode a = join("a", {"b"});
  TestNode b = join("b", {"a", "c"});
  NodeOptions options_of_c = options("c");
  options_of_c.neighbours = {"b", "d"};
  options_of_c.hop_limit = 1;
  TestNode c = join(options_of_c);
  TestNode d = join("d", {"c"});
  connect(a, d, b, c);
  BlockChannel from = a.channel();
  BlockChannel to = d.channel();
  ASSERT_EQ(from.send(d.address(), bytes_of("far")), SendResult::sent);
  settle(a, b, c, d);
  EXPECT_EQ(d.next(to), "nothing");
  EXPECT_EQ(counters(c).loops.load(), 1U);
  EXPECT_EQ(counters(b).forwarded.load(), 1U);
}

TEST_F(BlockRouterTest, ABlockThatComesBackToWhereItWasIsDroppedAndCounted) {
  TestNode a = join("a");
  TestNode b = join("b");
  TestNode c = join("c");
  connect(a, b, c);
  // As a node with another view of the world would send it: b is asked to carry what b has carried before.
  OutLink link(LinkMemory::make(link_name(pool(), "blocks", 100, b.address().node), {100, 7},
                                {b.address().node, 1}, kMinRingSlots)
                   .value(),
               {b.address().node, 1});
  NodeRecord stranger;
  stranger.name.assign("stranger");
  stranger.generation = 7;
  NodeDirectory directory = NodeDirectory::open(pool()).value();
  stranger.process = directory.record(a.address().node)->process;
  directory.slot(100).record.write(stranger);
  directory.slot(b.address().node).incoming[99 / 64].fetch_or(std::uint64_t{1} << (99 % 64));
  BlockHeader header;
  header.source = NodeAddress{.host = 0, .node = 100}.number();
  header.destination = c.address().number();
  header.channel = channel_number("test");
  header.hops = 2;
  header.path = {static_cast<std::uint8_t>(b.address().node), 101};
  ASSERT_EQ(link.put(header, bytes_of("round and round")), PutResult::put);
  settle(a, b, c);
  EXPECT_EQ(counters(b).loops.load(), 1U);
  EXPECT_EQ(counters(b).forwarded.load(), 0U);
  header.path = {101, 102};
  ASSERT_EQ(link.put(header, bytes_of("straight on")), PutResult::put);
  settle(a, b, c);
  BlockChannel to = c.channel();
  EXPECT_EQ(c.next(to), "straight on");
}

TEST_F(BlockRouterTest, CongestionBehindTheNodeBetweenIsFeltByTheSender) {
  TestNode a = join("a", {"b"});
  TestNode b = join("b");
  TestNode c = join("c", {"b"});
  connect(a, c, b);
  BlockChannel from = a.channel();
  BlockChannel to = c.channel();
  std::uint32_t sent = 0;
  for (; sent < 10 * kMinRingSlots; ++sent) {
    if (from.send(c.address(), bytes_of(std::to_string(sent))) != SendResult::sent) break;
    b.router->serve(now_);
  }
  EXPECT_GE(sent, 2 * kMinRingSlots - 4);
  EXPECT_LE(sent, 2 * kMinRingSlots);
  EXPECT_EQ(counters(b).congested.load(), 0U);
  settle(c);
  for (std::uint32_t i = 0; i < sent; ++i) {
    ASSERT_EQ(c.next(to), std::to_string(i));
    b.router->serve(now_);
  }
}

TEST_F(BlockRouterTest, ABlockForAllComesToEachNodeOnceAndNotBack) {
  TestNode a = join("a");
  TestNode b = join("b");
  TestNode c = join("c");
  TestNode d = join("d");
  for (TestNode* node : {&b, &c, &d}) (void)node->channel();
  settle(a, b, c, d);
  BlockChannel from = a.channel();
  ASSERT_EQ(from.send(kAll, bytes_of("all")), SendResult::sent);
  settle(a, b, c, d);
  for (TestNode* node : {&b, &c, &d}) {
    BlockChannel channel = node->channel();
    EXPECT_EQ(node->next(channel), "all");
    EXPECT_EQ(node->received.from, a.address());
    EXPECT_EQ(node->next(channel), "nothing");
  }
  EXPECT_EQ(a.next(from), "nothing");
}

TEST_F(BlockRouterTest, ABlockForAllComesToEachNodeOfARingOnce) {
  TestNode a = join("a", {"b", "d"});
  TestNode b = join("b", {"a", "c"});
  TestNode c = join("c", {"b", "d"});
  TestNode d = join("d", {"a", "c"});
  for (TestNode* node : {&a, &b, &c, &d}) (void)node->channel();
  settle(a, b, c, d);
  for (TestNode* sender : {&a, &b, &c, &d}) {
    BlockChannel from = sender->channel();
    for (int i = 0; i < 5; ++i) {
      ASSERT_EQ(from.send(kAll, bytes_of(std::to_string(i))), SendResult::sent);
    }
    settle(a, b, c, d);
    for (TestNode* node : {&a, &b, &c, &d}) {
      BlockChannel channel = node->channel();
      for (int i = 0; i < 5 && node != sender; ++i) EXPECT_EQ(node->next(channel), std::to_string(i));
      EXPECT_EQ(node->next(channel), "nothing");
    }
  }
}

TEST_F(BlockRouterTest, ANodeWithoutAChannelIsGivenNoBlockForAll) {
  TestNode a = join("a");
  TestNode b = join("b");
  settle(a, b);
  ASSERT_EQ(a.channel().send(kAll, bytes_of("which makes the link")), SendResult::sent);
  settle(a, b);
  const auto before = b.node->arrivals().count();
  ASSERT_EQ(a.channel().send(kAll, bytes_of("all")), SendResult::sent);
  settle(a, b);
  EXPECT_EQ(b.node->arrivals().count(), before) << "nobody would ever take it";
  BlockChannel late = b.channel();
  ASSERT_EQ(a.channel().send(kAll, bytes_of("again")), SendResult::sent);
  settle(a, b);
  EXPECT_EQ(b.next(late), "again");
}

TEST_F(BlockRouterTest, ASecondCopyOfABlockForAllIsDroppedAndCounted) {
  TestNode a = join("a");
  TestNode b = join("b");
  for (TestNode* node : {&a, &b}) (void)node->channel();
  settle(a, b);
  BlockHeader header;
  header.source = NodeAddress{.host = 3, .node = 9}.number();
  header.destination = kAll.number();
  header.channel = channel_number("test");
  header.epoch = 4;
  header.sequence = 17;
  for (int i = 0; i < 2; ++i) {
    ASSERT_EQ(a.node->inject(header, bytes_of("from afar")), SendResult::sent);
    settle(a, b);
  }
  for (TestNode* node : {&a, &b}) {
    BlockChannel channel = node->channel();
    EXPECT_EQ(node->next(channel), "from afar");
    EXPECT_EQ(node->next(channel), "nothing");
  }
  EXPECT_EQ(counters(a).duplicates.load(), 1U);
}

// Two pools, as two hosts are, with a gateway in each.
TEST_F(BlockRouterTest, NodesOfTwoHostsTalkThroughTheirGateways) {
  UniquePoolName second_pool;
  {
    TestNode gateway_1;
    TestNode gateway_2;
    NodeOptions options_1 = options("gateway");
    options_1.host_number = 1;
    options_1.entry.hosts = {{.first = 2, .last = 9}};
    options_1.remote = [&](const BlockHeader& header, std::span<const std::byte> contents) {
      return gateway_2.node->inject(header, contents);
    };
    gateway_1 = join(options_1);
    NodeOptions options_2 = options("gateway");
    options_2.pool = second_pool.get();
    options_2.host_number = 2;
    options_2.entry.hosts = {{.first = 1, .last = 1}};
    options_2.remote = [&](const BlockHeader& header, std::span<const std::byte> contents) {
      return gateway_1.node->inject(header, contents);
    };
    gateway_2 = join(options_2);
    TestNode a = join("a");
    NodeOptions options_of_b = options("b");
    options_of_b.pool = second_pool.get();
    TestNode b = join(options_of_b);
    BlockChannel at_a = a.channel();
    BlockChannel at_b = b.channel();
    const NodeAddress b_from_afar{.host = 2, .node = b.address().node};
    for (int turn = 0; turn < 10; ++turn) {
      (void)at_a.send(b_from_afar, bytes_of("over there"));
      settle(a, gateway_1, gateway_2, b);
      if (b.next(at_b) == "over there") break;
    }
    EXPECT_EQ(b.received.from, (NodeAddress{.host = 1, .node = a.address().node}));
    for (int turn = 0; turn < 10 && a.next(at_a) != "and back"; ++turn) {
      (void)at_b.send(b.received.from, bytes_of("and back"));
      settle(a, gateway_1, gateway_2, b);
    }
    EXPECT_EQ(a.received.from, b_from_afar);
    EXPECT_EQ(at_a.send({.host = 10, .node = 1}, {}), SendResult::unreachable);
    // An address with the own host's number means a neighbour.
    EXPECT_EQ(at_a.send({.host = 1, .node = a.address().node}, bytes_of("me")), SendResult::sent);
  }
  NodeDirectory::remove(second_pool.get());
}

// Another thread makes room: see BlockGateway.
TEST_F(BlockRouterTest, ABlockForAnotherHostDoesNotOvertakeOneThatFoundNoRoom) {
  std::vector<std::string> given;
  int asked = 0;
  NodeOptions options_of_gateway = options("gateway");
  options_of_gateway.host_number = 1;
  options_of_gateway.entry.hosts = {{.first = 2, .last = 3}};
  options_of_gateway.remote_room = [&](NodeAddress to, std::uint32_t /*slots*/) {
    return to.host == 3 || ++asked != 1;
  };
  options_of_gateway.remote = [&](const BlockHeader& /*header*/, std::span<const std::byte> contents) {
    std::string text(contents.size(), ' ');
    std::ranges::transform(contents, text.begin(), [](std::byte byte) { return static_cast<char>(byte); });
    given.push_back(std::move(text));
    return SendResult::sent;
  };
  TestNode gateway = join(options_of_gateway);
  TestNode a = join("a");
  connect(a, gateway);
  BlockChannel channel = a.channel();
  const NodeAddress there{.host = 2, .node = 1};
  ASSERT_EQ(channel.send(there, bytes_of("first")), SendResult::sent);
  ASSERT_EQ(channel.send(there, bytes_of("second")), SendResult::sent);
  ASSERT_EQ(channel.send({.host = 3, .node = 1}, bytes_of("elsewhere")), SendResult::sent);
  settle(a, gateway);
  EXPECT_EQ(given, (std::vector<std::string>{"elsewhere", "first", "second"}));
}

TEST_F(BlockRouterTest, RunsInAThreadOfItsOwnUntilItIsStopped) {
  TestNode a = join("a");
  TestNode b = join("b");
  std::atomic<bool> stop{false};
  std::thread first([&] { a.router->run(stop); });
  std::thread second([&] { b.router->run(stop); });
  BlockChannel from = a.channel();
  BlockChannel to = b.channel();
  while (from.send(b.address(), bytes_of("x")) != SendResult::sent) std::this_thread::yield();
  while (b.next(to) != "x") std::this_thread::yield();
  stop.store(true);
  a.router->wake();
  b.router->wake();
  first.join();
  second.join();
}

}  // namespace
}  // namespace plchost
