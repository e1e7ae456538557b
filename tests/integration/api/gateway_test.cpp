#include <algorithm>
#include <cstddef>
#include <cstring>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "tests/integration/api/gateway_side.hpp"
#include "tests/integration/api/test_host.hpp"
#include "tests/support/further_round.hpp"

namespace plchost {
namespace {

using Json = nlohmann::json;

std::vector<std::byte> pattern(std::size_t size, std::size_t seed = 0) {
  std::vector<std::byte> bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i * 31 + i / 257 + seed);
  return bytes;
}

bool becomes(const std::function<bool()>& true_at_last) {
  for (const TimePoint end = soon(); MonotonicClock::now() < end; ::usleep(1000)) {
    if (true_at_last()) return true;
  }
  return false;
}

class Gateway : public testing::Test {
 protected:
  SendResult send(Side& from, NodeAddress to, std::span<const std::byte> contents) {
    SendResult result = SendResult::unreachable;
    EXPECT_TRUE(becomes([&] {
      result = from.channel.send(to, contents);
      return result == SendResult::sent;
    })) << static_cast<int>(result);
    return result;
  }
  /// Until blocks go from one to the other, and back.
  void meet(Side& one, std::uint16_t number, Side& other, std::uint16_t other_number) {
    ASSERT_TRUE(reach(one, other.address_at(other_number), other));
    ASSERT_TRUE(reach(other, one.address_at(number), one));
  }
  [[nodiscard]] Json nodes(const std::string& host) const {
    const auto result = run_plcctl(domain_.number(), {"--host", host, "list", "nodes", "--json"});
    EXPECT_EQ(result.code, 0) << result.errors;
    return Json::parse(result.output);
  }
  /// Each comes once and in order. The trouble of a machine that stood still: blocks to a host that is not
  /// reached are lost. Empty: all have come.
  static std::string send_many(Side& from, Side& at, NodeAddress to) {
    constexpr std::uint32_t kMany = 20'000;
    std::uint32_t sent = 0;
    std::vector<std::byte> contents(200);
    for (std::uint32_t received = 0; received < kMany;) {
      for (int burst = 0; burst < 100 && sent < kMany; ++burst) {
        std::memcpy(contents.data(), &sent, sizeof sent);
        const auto result = from.channel.send(to, contents);
        if (result == SendResult::unreachable) return "the other host was not reached";
        EXPECT_TRUE(result == SendResult::sent || result == SendResult::congested);
        if (result == SendResult::sent) ++sent;
      }
      while (received < kMany) {
        const auto block = at.next(sent < kMany ? Duration::zero() : kPatience);
        if (!block) break;
        std::uint32_t number = 0;
        std::memcpy(&number, block->data(), sizeof number);
        EXPECT_GE(number, received) << "twice, or out of order";
        if (number != received) return fmt::format("block {} came behind block {}", number, received - 1);
        ++received;
      }
      if (sent == kMany && received < kMany) return fmt::format("{} blocks have come", received);
    }
    return "";
  }
  [[nodiscard]] std::string hosts_of_gateway(const std::string& host) const {
    for (const Json& node : nodes(host)) {
      if (node["name"] == "gateway") return node["hosts"];
    }
    return "no gateway";
  }

  OwnDomain domain_;
};

TEST_F(Gateway, BlocksOfAllSizesGoToANodeOfAnotherHostAndRepliesComeBack) {
  Side south(domain_, "south", 2, "packer");
  Side north(domain_, "north", 1, "press");
  meet(north, 1, south, 2);
  for (const std::size_t size : {0U, 1U, 512U, 5000U, 65536U}) {
    const auto contents = pattern(size, size);
    std::uint32_t correlation = 0;
    ASSERT_TRUE(becomes([&] {
      return north.channel.request(south.address_at(2), contents, correlation) == SendResult::sent;
    }));
    const auto request = south.next();
    ASSERT_TRUE(request);
    EXPECT_TRUE(*request == contents) << size;
    EXPECT_EQ(south.received.from, north.address_at(1));
    EXPECT_EQ(south.received.kind, BlockKind::request);
    const Received asked = south.received;
    ASSERT_TRUE(becomes([&] { return south.channel.reply(asked, contents) == SendResult::sent; }));
    const auto reply = north.next();
    ASSERT_TRUE(reply);
    EXPECT_TRUE(*reply == contents) << size;
    EXPECT_EQ(north.received.from, south.address_at(2));
    EXPECT_EQ(north.received.correlation, correlation);
  }
  EXPECT_TRUE(becomes([&] { return hosts_of_gateway("north") == "2"; }));
  EXPECT_TRUE(becomes([&] { return hosts_of_gateway("south") == "1"; }));
  for (const Json& node : nodes("north")) EXPECT_EQ(node["host_number"], 1);
}

TEST_F(Gateway, NodesOfOtherHostsAreFoundByName) {
  Side south(domain_, "south", 2, "packer");
  Side north(domain_, "north", 1, "press");
  NodeAddress found;
  ASSERT_TRUE(becomes([&] {
    found = north.node.node().find("packer@south");
    return found.node != 0;
  }));
  EXPECT_EQ(found, south.address_at(2));
  EXPECT_TRUE(reach(north, found, south));
  for (const char* nobody :
       {"packer", "paker@south", "packer@east", "packer@", "@south", "@", "press@south"}) {
    EXPECT_EQ(north.node.node().find(nobody).node, 0) << nobody;
  }
  const RunningNode late(south.host, "late");
  EXPECT_TRUE(becomes([&] { return north.node.node().find("late@south").node != 0; }));
}

TEST_F(Gateway, ManyBlocksComeOnceEachAndInOrderHoweverFastTheyAreSent) {
  Side south(domain_, "south", 2, "packer");
  Side north(domain_, "north", 1, "press");
  const auto failures = [&] {
    std::map<std::string, std::uint64_t> counts;
    for (const char* host : {"north", "south"}) {
      for (const Json& node : nodes(host)) {
        for (const char* counter : {"lost", "refused", "congested", "expired"}) {
          counts[fmt::format("{} {}", host, counter)] += node[counter].get<std::uint64_t>();
        }
      }
    }
    return counts;
  };
  std::string trouble = "not begun";
  for (int round = 0; round < 3 && !trouble.empty(); ++round) {
    if (round > 0) say_further_round(trouble);
    meet(north, 1, south, 2);
    const auto before = failures();
    trouble = send_many(north, south, south.address_at(2));
    if (trouble.empty()) {
      EXPECT_EQ(failures(), before);
    }
  }
  EXPECT_EQ(trouble, "");
}

TEST_F(Gateway, ABlockForAllNodesOfAllHostsComesToEachOnce) {
  Side south(domain_, "south", 2, "packer");
  Side north(domain_, "north", 1, "press");
  Side west(domain_, "west", 3, "filler");
  RunningNode second(south.host, "second");
  BlockChannel at_second = BlockChannel::open(second.node(), "test").value();
  meet(north, 1, south, 2);
  meet(north, 1, west, 3);
  ASSERT_TRUE(becomes([&] { return second.node().find("packer").node != 0; }));
  const auto contents = pattern(3000);
  send(north, {.host = NodeAddress::kAllHosts, .node = NodeAddress::kAllNodes}, contents);
  for (Side* side : {&south, &west}) {
    const auto block = side->next();
    ASSERT_TRUE(block);
    EXPECT_TRUE(*block == contents);
    EXPECT_EQ(side->received.from, north.address_at(1));
  }
  Received received;
  std::vector<std::byte> buffer(kMaxBlockSize);
  EXPECT_TRUE(becomes([&] { return at_second.receive(buffer, received) == TakeResult::taken; }));
  send(north, {.host = 2, .node = NodeAddress::kAllNodes}, contents);
  EXPECT_TRUE(south.next());
  constexpr Duration kWhile = std::chrono::milliseconds(300);
  EXPECT_FALSE(south.next(kWhile));
  EXPECT_FALSE(west.next(kWhile)) << "only the first was for all hosts";
  EXPECT_FALSE(north.next(Duration::zero())) << "nothing comes back";
}

TEST_F(Gateway, IsBackByItselfAfterItsServerWasKilled) {
  Side south(domain_, "south", 2, "packer");
  Side north(domain_, "north", 1, "press");
  meet(north, 1, south, 2);
  RunningNode neighbour(south.host, "neighbour");
  BlockChannel at_neighbour = BlockChannel::open(neighbour.node(), "test").value();
  const auto within_the_host = [&] {
    return becomes([&] { return at_neighbour.send(south.node.node().address(), {}) == SendResult::sent; }) &&
           south.next().has_value();
  };
  ASSERT_TRUE(within_the_host());
  south.host.replace_server();
  EXPECT_TRUE(within_the_host());
  EXPECT_TRUE(reach(north, south.address_at(2), south));
  north.host.replace_server();
  EXPECT_TRUE(reach(south, north.address_at(1), north));
  EXPECT_TRUE(within_the_host());
}

TEST_F(Gateway, SendersAreToldWhenAHostIsGone) {
  Side north(domain_, "north", 1, "press");
  {
    Side south(domain_, "south", 2, "packer");
    meet(north, 1, south, 2);
    EXPECT_EQ(north.channel.send({.host = 7, .node = 1}, {}), SendResult::unreachable);
    south.host.server().signal(SIGSTOP);
    EXPECT_TRUE(becomes(
        [&] { return north.channel.send(south.address_at(2), pattern(60000)) == SendResult::unreachable; }));
    south.host.server().signal(SIGCONT);
    EXPECT_TRUE(becomes([&] { return north.channel.send(south.address_at(2), {}) == SendResult::sent; }));
  }
  EXPECT_TRUE(
      becomes([&] { return north.channel.send({.host = 2, .node = 1}, {}) == SendResult::unreachable; }));
}

// Blocks that have left their sender wait for room on the way to a host that is not heard any more.
TEST_F(Gateway, BlocksForAHostThatFallsSilentAreCountedAsWithoutARoute) {
  Side north(domain_, "north", 1, "press");
  Side south(domain_, "south", 2, "packer");
  meet(north, 1, south, 2);
  const auto without_route = [&] {
    std::uint64_t count = 0;
    for (const Json& node : nodes("north")) {
      if (node["name"] == "gateway") count = node["no_route"];
    }
    return count;
  };
  const std::uint64_t before = without_route();  // one that was on its way while the hosts met
  south.host.server().signal(SIGSTOP);
  const auto contents = pattern(20000);
  bool waits = false;  // as many are under way as may be
  for (int i = 0; i < 2000 && !waits; ++i) {
    waits = north.channel.send(south.address_at(2), contents) == SendResult::congested;
  }
  EXPECT_TRUE(waits);
  EXPECT_TRUE(
      becomes([&] { return north.channel.send(south.address_at(2), contents) == SendResult::unreachable; }));
  EXPECT_TRUE(becomes([&] { return without_route() > before; }));
  south.host.server().signal(SIGCONT);
  EXPECT_TRUE(becomes([&] { return north.channel.send(south.address_at(2), {}) == SendResult::sent; }));
}

TEST_F(Gateway, ANodeThatTakesNothingIsFeltByWhoSendsToItAndByNobodyElse) {
  Side south(domain_, "south", 2, "packer");
  Side north(domain_, "north", 1, "press");
  RunningNode idle(south.host, "idle");
  meet(north, 1, south, 2);
  const NodeAddress to_idle{.host = 2, .node = idle.node().address().node};
  const auto large = pattern(60000);
  bool felt = false;
  for (int i = 0; i < 2000 && !felt; ++i) {
    felt = north.channel.send(to_idle, large) == SendResult::congested;
    if (i % 10 == 0) {
      ASSERT_TRUE(becomes([&] {
        const auto result = north.channel.send(south.address_at(2), {}, BlockPriority::high);
        return result == SendResult::sent;
      }));
      ASSERT_TRUE(south.next());
    }
  }
  EXPECT_TRUE(felt);
}

TEST_F(Gateway, OfTwoHostsOfOneNumberTheLaterOneDoesNotServeAndSaysSo) {
  Side north(domain_, "north", 1, "press");
  Side south(domain_, "south", 2, "packer");
  meet(north, 1, south, 2);
  Side west(domain_, "west", 2, "filler");  // of equal age, and the greater name
  // Until it has heard of south.
  ASSERT_TRUE(becomes([&] { return hosts_of_gateway("west").empty(); })) << hosts_of_gateway("west");
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(reach(north, south.address_at(2), south));
    (void)west.channel.send(north.address_at(1), {});
    EXPECT_FALSE(north.next(std::chrono::milliseconds(20)));
  }
  EXPECT_FALSE(west.next(Duration::zero()));
  EXPECT_EQ(west.channel.send(north.address_at(1), {}), SendResult::unreachable);
}

}  // namespace
}  // namespace plchost
