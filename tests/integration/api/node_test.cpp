#include <algorithm>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "shm/block_driver/block_channel.hpp"
#include "shm/files/pool_files.hpp"
#include "tests/integration/api/running_node.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;
using Json = nlohmann::json;

class Nodes : public testing::Test {
 protected:
  Nodes() { host_.start_server(); }
  ~Nodes() override { NodeDirectory::remove(host_.pool_name()); }
  [[nodiscard]] RunResult run(std::vector<std::string> arguments) const {
    return run_plcctl(domain_.number(), std::move(arguments));
  }
  [[nodiscard]] Json json(std::vector<std::string> arguments) const {
    arguments.emplace_back("--json");
    const auto result = run(std::move(arguments));
    EXPECT_EQ(result.code, 0) << result.errors;
    return Json::parse(result.output);
  }
  /// Sends until the link is there.
  static void send(RunningNode& from, NodeAddress to, std::size_t size) {
    BlockChannel channel = BlockChannel::open(from.node(), "test").value();
    const std::vector<std::byte> contents(size);
    SendResult result = SendResult::connecting;
    for (const TimePoint end = soon(); result != SendResult::sent && MonotonicClock::now() < end;) {
      result = channel.send(to, contents);
    }
    EXPECT_EQ(result, SendResult::sent);
  }

  OwnDomain domain_;
  TestHost host_{domain_, "hosta"};
};

TEST_F(Nodes, ThereAreNoneBeforeTheFirstHasJoined) {
  EXPECT_EQ(json({"list", "nodes"}).size(), 0U);
  EXPECT_EQ(json({"show", "routes"}).size(), 0U);
}

TEST_F(Nodes, AreListedWithWhatTheyAreAndCount) {
  RunningNode press(host_, "press");
  RunningNode packer(host_, "packer");
  send(press, packer.node().address(), 100);
  const Json all = json({"list", "nodes"});
  ASSERT_EQ(all.size(), 2U) << all;
  const bool press_first = press.node().address().node < packer.node().address().node;
  EXPECT_EQ(all[0]["name"], press_first ? "press" : "packer") << "by address";
  const Json& listed = all[press_first ? 1 : 0];
  EXPECT_EQ(listed["node"], packer.node().address().node);
  EXPECT_EQ(listed["pid"], ::getpid());
  EXPECT_EQ(listed["program"], "integration_api");
  EXPECT_EQ(listed["base"], "blocks");
  EXPECT_EQ(listed["forwards"], true);
  EXPECT_EQ(listed["queue_slots"], 1024);
  EXPECT_GE(listed["arrivals"], 1);
  EXPECT_EQ(listed["no_route"], 0);
  const auto table = run({"list", "nodes"}).output;
  EXPECT_THAT(table, testing::AllOf(HasSubstr("packer"), HasSubstr("CONGESTED"), HasSubstr("HOSTS")));
  EXPECT_EQ(json({"list", "nodes", "--base", "others"}).size(), 0U);
}

TEST_F(Nodes, ShowTheWaysBetweenThemAndWhatTheFirstLinkCounts) {
  RunningNode a(host_, "a", {"b"});
  RunningNode b(host_, "b");
  RunningNode c(host_, "c", {"b"});
  Json routes;
  for (const TimePoint end = soon(); MonotonicClock::now() < end;) {
    routes = json({"show", "routes"});
    if (routes.size() == 6) break;
  }
  ASSERT_EQ(routes.size(), 6U) << routes;
  send(a, c.node().address(), 1000);
  // Nobody receives it: it waits at c, and is no longer between a and b.
  routes = json({"show", "routes", "a"});
  ASSERT_EQ(routes.size(), 2U) << routes;
  const Json& to_c = routes[routes[0]["to_name"] == "c" ? 0 : 1];
  EXPECT_EQ(to_c["from_name"], "a");
  EXPECT_EQ(to_c["next_hop"], b.node().address().node);
  EXPECT_EQ(to_c["links"], 2);
  EXPECT_EQ(to_c["linked"], true);
  EXPECT_EQ(to_c["sent"], 1);
  EXPECT_EQ(to_c["sent_bytes"], 1000);
  EXPECT_EQ(to_c["congested"], 0);
  const auto by_address = json({"show", "routes", fmt::format("{}", a.node().address().node)});
  EXPECT_EQ(by_address.size(), 2U);
  EXPECT_EQ(by_address[0]["from_name"], "a");
}

TEST_F(Nodes, BlocksThatNobodyReceivesAreSeenWaiting) {
  RunningNode a(host_, "a");
  RunningNode b(host_, "b");
  send(a, b.node().address(), 10);
  for (int i = 0; i < 4; ++i) send(a, b.node().address(), 1000);
  const Json routes = json({"show", "routes", "a"});
  ASSERT_EQ(routes.size(), 1U);
  EXPECT_EQ(routes[0]["sent"], 5);
  EXPECT_EQ(routes[0]["waiting"].get<int>() + routes[0]["expired"].get<int>(), 5) << routes;
}

TEST_F(Nodes, ThatAreNotThereAreNamed) {
  const RunningNode packer(host_, "packer");
  const auto wrong = run({"show", "routes", "paker"});
  EXPECT_EQ(wrong.code, 1);
  EXPECT_THAT(wrong.errors, testing::AllOf(HasSubstr("paker"), HasSubstr("did you mean 'packer'?")));
  EXPECT_EQ(run({"show", "routes", "a/b"}).code, 2);
  EXPECT_EQ(run({"list", "nodes", "--base", std::string(32, 'a')}).code, 2);
}

TEST_F(Nodes, AStrangerWhoScribblesIsNoNodeAndDoesNotEndTheServer) {
  RunningNode a(host_, "a");
  RunningNode b(host_, "b");
  send(a, b.node().address(), 10);
  const auto directory =
      MemoryFile::open(pool_memory_name(host_.pool_name(), "blocks"), 1, MemoryFile::Access::read_write);
  const auto link = MemoryFile::open(
      link_name(host_.pool_name(), "blocks", a.node().address().node, b.node().address().node), 1,
      MemoryFile::Access::read_write);
  ASSERT_TRUE(directory && link);
  const pid_t server = host_.server().pid();
  for (const int fill : {0xff, 0x01}) {
    std::ranges::fill(link->bytes(), static_cast<std::byte>(fill));
    // All but magic, version and size: else it is no directory at all, which comes last.
    std::ranges::fill(directory->bytes().subspan(64), static_cast<std::byte>(fill));
    for (const char* noun : {"nodes", "routes"}) {
      const auto result = run({noun == std::string("nodes") ? "list" : "show", noun, "--json"});
      EXPECT_EQ(result.code, 0) << result.errors;
    }
  }
  std::ranges::fill(directory->bytes(), std::byte{0x5a});
  // Those who use it write again what it says of itself, and of them.
  RunResult nodes = run({"list", "nodes"});
  for (const TimePoint end = soon(); nodes.code != 0 && MonotonicClock::now() < end;) {
    EXPECT_THAT(nodes.errors, HasSubstr("no directory of nodes"));
    nodes = run({"list", "nodes"});
  }
  EXPECT_EQ(nodes.code, 0) << nodes.errors;
  EXPECT_EQ(host_.server().pid(), server);
  EXPECT_EQ(run({"list", "hosts"}).code, 0);
}

}  // namespace
}  // namespace plchost
