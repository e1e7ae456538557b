// The calls of the client library that a host answers by lists, by its findings or by its clock, and watches
// by name.
#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <unistd.h>

#include "shm/files/pool_files.hpp"
#include "shm/operations/operations.hpp"
#include "tests/integration/api/client_library.hpp"
#include "tests/integration/api/running_node.hpp"

namespace plchost {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

using ClientLists = ClientLibrary;

TEST_F(ClientLists, HasAllOperationsOfTheContract) {
  std::set<std::string> known{
      "check host",     "list objects", "list nodes",  // functions of their own
      "list routes",    "read clock",   "read log",   "download application",
      "list variables", "read debug",  // of plcctl debug alone: see instances/debugging.md
      "read trace"};                   // of plcctl record trace alone
  for (const auto& operation : Client::operations()) known.insert(operation.name);
  for (const Operation& operation : operations()) {
    if (operation.place == OperationPlace::internal) continue;
    EXPECT_THAT(known, Contains(std::string(operation.name)));
  }
}

TEST_F(ClientLists, ShowTheObjectsWithTheirUsers) {
  ObjectPool pool = ObjectPool::attach(host_.pool_name()).value();
  const auto slots = pool.create_semaphore("line1/slots", 7).value();
  const auto image = pool.create_memory("image", 4096).value();
  Client sut(options());
  const auto all = sut.objects("hosta");
  std::vector<std::string> names;
  for (const Client::Object& object : all) names.push_back(object.name);
  EXPECT_THAT(names, ElementsAre("image", "line1/ready", "line1/slots")) << "by name";
  EXPECT_EQ(all.front().type, "memory");
  EXPECT_EQ(all.front().size, 4096U);
  ASSERT_EQ(all.front().references.size(), 1U);
  EXPECT_EQ(all.front().references.front().pid, ::getpid());
  EXPECT_EQ(all.front().references.front().program, "integration_api");
  const auto some = sut.objects({}, "*/slots");
  ASSERT_EQ(some.size(), 1U);
  EXPECT_EQ(some.front().value, 7U);
  const TimePoint end = soon();  // the status comes a moment later
  while (sut.hosts().front().objects != 3 && MonotonicClock::now() < end) ::usleep(10'000);
  EXPECT_EQ(sut.hosts().front().objects, 3U);
}

TEST_F(ClientLists, ShowTheNodesAndTheWaysBetweenThem) {
  Client sut(options());
  EXPECT_TRUE(sut.nodes().empty());
  {
    RunningNode press(host_, "press");
    RunningNode packer(host_, "packer", {"press"});
    const auto nodes = sut.nodes("hosta");
    std::set<std::string> names;
    for (const Client::Node& node : nodes) names.insert(node.name);
    EXPECT_THAT(names, ElementsAre("packer", "press"));
    EXPECT_EQ(nodes.front().pid, ::getpid());
    const unsigned from = packer.node().address().node;
    const unsigned to = press.node().address().node;
    const auto is_way = [&](const Client::Route& route) {
      return route.from_node == from && route.to_node == to && route.next_hop == to;
    };
    bool found = false;
    for (const TimePoint end = soon(); !found && MonotonicClock::now() < end;) {
      found = std::ranges::any_of(sut.routes("hosta"), is_way);
    }
    EXPECT_TRUE(found);
    EXPECT_TRUE(sut.nodes("hosta", "others").empty());
  }
  NodeDirectory::remove(host_.pool_name());
}

TEST_F(ClientLists, ReadTheClockOfTheHost) {
  Client sut(options());
  const Client::Clock clock = sut.read_clock("hosta");
  EXPECT_GT(clock.uncertainty.count(), 0);
  EXPECT_LE(std::chrono::abs(clock.offset), clock.uncertainty) << "it is the same clock";
}

TEST_F(ClientLists, HaveTheHostLookedAtAnew) {
  host_.find({{"swap", FindingLevel::note, "swap", "/dev/sda2", "it is slow", "swapoff -a"},
              {"governor", FindingLevel::warning, "core 1", "powersave", "slow at first", ""}});
  Client sut(options());
  const auto before = host_.checks();
  const auto findings = sut.check_host("hosta");
  EXPECT_GT(host_.checks(), before);
  ASSERT_EQ(findings.size(), 2U);
  EXPECT_EQ(findings[0].id, "swap");
  EXPECT_EQ(findings[0].level, "note");
  EXPECT_EQ(findings[0].advice, "swapoff -a");
  EXPECT_EQ(findings[1].found, "powersave");
}

TEST_F(ClientLists, WatchAnyStatusTopicByItsName) {
  Client sut(options());
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<Client::Record> told;
  const auto tell = [&](const Client::Record& record) {
    const std::lock_guard lock(mutex);
    told.push_back(record);
    changed.notify_all();
  };
  const auto has = [](const Client::Record& record, const std::string& name, const Client::Value& value) {
    return std::ranges::find(record, std::pair(name, value)) != record.end();
  };
  const auto until = [&](const auto& is_it) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, kPatience, [&] { return std::ranges::any_of(told, is_it); });
  };
  const auto of_instances = sut.watch_status("instance", "hosta", tell);
  EXPECT_TRUE(until([&](const auto& one) {
    return has(one, "instance", std::string("line1")) && has(one, "removed", false);
  }));
  host_.write_count(0);
  EXPECT_TRUE(until([&](const auto& one) {
    return has(one, "instance", std::string("line1")) && has(one, "removed", true);
  }));
  const auto of_writers = sut.watch_status("writer", {}, tell);
  EXPECT_EQ(sut.post("hosta", "line1/ready", 3).accepted, 3U);
  EXPECT_TRUE(until([&](const auto& one) { return has(one, "delivered", 3ULL); }));
  const ClientError unknown = error_of([&] { (void)sut.watch_status("weather", {}, tell); });
  EXPECT_EQ(unknown.code(), ClientError::invalid_argument);
  EXPECT_THAT(unknown.what(), HasSubstr("no status topic 'weather'; there are: "));
}

}  // namespace
}  // namespace plchost
