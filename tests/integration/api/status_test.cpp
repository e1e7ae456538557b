#include <thread>

#include <gmock/gmock.h>

#include "api/client/control_client.hpp"
#include "api/dds/text.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(RemoteStatus, ShowsTwoHostsOfOneDomainApart) {
  const OwnDomain domain;
  TestHost first(domain, "hosta");
  TestHost second(domain, "hostb");
  first.write_instance(0, "line1", InstanceState::running, 1);
  first.write_count(1);
  second.write_instance(0, "line1", InstanceState::failed);
  second.write_instance(1, "line2", InstanceState::offline);
  second.write_count(2);
  const PoolEvent event = second.add_event("line1", "ready");
  first.start_server();
  second.start_server();
  const auto sut = connect(domain);

  std::vector<HostView> hosts;
  while (hosts.size() < 2) hosts = sut->hosts(soon());

  EXPECT_EQ(hosts[0].name, "hosta");
  EXPECT_EQ(hosts[1].name, "hostb");
  EXPECT_EQ(sut->instances("hosta", soon()).value().size(), 1U);
  const auto instances = sut->instances("hostb", soon()).value();
  ASSERT_EQ(instances.size(), 2U);
  EXPECT_EQ(instances[0].state, 7U);
  EXPECT_EQ(dds::text_of(instances[1].instance), "line2");
  const auto report = sut->post_event({"hostb", 0, "line1", "ready"}, 10, Duration::zero(), seconds(20));
  ASSERT_TRUE(report);
  EXPECT_EQ(report->accepted, 10U);
  EXPECT_EQ(event.counted().count(), 10U);
  const auto wrong = sut->post_event({"hosta", 0, "line1", "ready"}, 1, Duration::zero(), seconds(20));
  ASSERT_TRUE(wrong);
  EXPECT_EQ(wrong->rejected, 1U);
}

TEST(RemoteStatus, FollowsTasksFromOneProcessToTheNext) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  const InstancePage old_page = host.make_page("line1", "Old", 100);
  host.write_instance(0, "line1", InstanceState::running, 100);
  host.write_count(1);
  host.start_server();
  const auto sut = connect(domain);
  ASSERT_TRUE(sut->host("hosta", soon()));
  auto tasks = sut->tasks("hosta", soon()).value();
  ASSERT_EQ(tasks.size(), 1U);
  EXPECT_EQ(dds::text_of(tasks[0].task), "Old");
  EXPECT_EQ(tasks[0].interval_ns, 1'000'000);

  host.write_instance(0, "line1", InstanceState::starting, 200);
  const InstancePage new_page = host.make_page("line1", "New", 200);

  while (tasks.size() != 1 || dds::text_of(tasks[0].task) != "New") {
    tasks = sut->tasks("hosta", soon()).value();
  }
  EXPECT_EQ(dds::text_of(sut->instances("hosta", soon()).value().at(0).scheduler), "CmpScheduleTimer");
}

TEST(RemoteStatus, ForgetsAnInstanceThatIsGone) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  host.write_instance(0, "line1", InstanceState::offline);
  host.write_instance(1, "line2", InstanceState::offline);
  host.write_count(2);
  host.start_server();
  const auto sut = connect(domain);
  ASSERT_TRUE(sut->host("hosta", soon()));
  ASSERT_EQ(sut->instances("hosta", soon()).value().size(), 2U);

  host.write_count(1);

  while (sut->instances("hosta", soon()).value().size() != 1) std::this_thread::sleep_for(milliseconds(5));
}

TEST(RemoteStatus, OfTheNextServerReplacesThatOfAKilledOne) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  host.write_instance(0, "line1", InstanceState::offline);
  host.write_instance(1, "line2", InstanceState::offline);
  host.write_count(2);
  host.start_server();
  const auto sut = connect(domain);
  const auto before = sut->host("hosta", soon()).value();
  ASSERT_EQ(sut->instances("hosta", soon()).value().size(), 2U);

  host.write_count(1);
  host.replace_server();

  auto after = before;
  while (after.epoch == before.epoch) after = sut->host("hosta", soon()).value();
  EXPECT_EQ(sut->instances("hosta", soon()).value().size(), 1U);
}

TEST(RemoteStatus, OfADomainWithoutHostsIsEmpty) {
  const OwnDomain domain;
  EXPECT_TRUE(connect(domain)->hosts(MonotonicClock::now() + milliseconds(100)).empty());
}

}  // namespace
}  // namespace plchost
