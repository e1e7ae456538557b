#include <algorithm>
#include <array>
#include <csignal>
#include <cstring>
#include <future>
#include <span>
#include <thread>

#include <gmock/gmock.h>

#include "api/client/control_client.hpp"
#include "api/dds/ended_participant.h"
#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"
#include "schedulers/tasks/task_recorder.hpp"
#include "shm/files/memory_file.hpp"
#include "tests/integration/api/test_host.hpp"
#include "tests/support/interrupted_write.hpp"

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
  const auto report = sut->post_event({"hostb", "line1", "ready"}, 10, Duration::zero(), seconds(20));
  ASSERT_TRUE(report);
  EXPECT_EQ(report->accepted, 10U);
  EXPECT_EQ(event.counted().count(), 10U);
  const auto wrong = sut->post_event({"hosta", "line1", "ready"}, 1, Duration::zero(), seconds(20));
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

TEST(RemoteStatus, ShowsATaskWhoseFiguresCannotBeReadYet) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  InstancePage page = host.make_page("line1", "Main", 100);
  interrupt_write(page.task(0).counters);
  host.write_instance(0, "line1", InstanceState::running, 100);
  host.write_count(1);
  host.start_server();
  const auto sut = connect(domain);
  ASSERT_TRUE(sut->host("hosta", soon()));

  const auto tasks = sut->tasks("hosta", soon()).value();

  ASSERT_EQ(tasks.size(), 1U);
  EXPECT_EQ(dds::text_of(tasks[0].task), "Main");
}

TEST(RemoteStatus, ShowsWhatAProcessRunsAlsoWhileItWritesThat) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  const InstancePage page = host.make_page("line1", "Main", 100);
  host.write_instance(0, "line1", InstanceState::running, 100);
  host.write_count(1);
  host.start_server();
  const auto sut = connect(domain);
  ASSERT_TRUE(sut->host("hosta", soon()));
  ASSERT_EQ(dds::text_of(sut->instances("hosta", soon()).value().at(0).scheduler), "CmpScheduleTimer");
  const auto memory = MemoryFile::open(instance_page_name(host.pool_name(), "line1"),
                                       sizeof(InstancePageLayout), MemoryFile::Access::read_write)
                          .value();
  interrupt_write(reinterpret_cast<InstancePageLayout*>(memory.bytes().data())->runtime);
  std::this_thread::sleep_for(milliseconds(100));  // the server looks at it every 10 ms

  EXPECT_EQ(dds::text_of(sut->instances("hosta", soon()).value().at(0).scheduler), "CmpScheduleTimer");
}

TEST(RemoteStatus, TellsTheStatisticsOfATaskAndAtOnceWhenTheyBeginAnew) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  InstancePage page = host.make_page("line1", "Main", 100);
  host.write_instance(0, "line1", InstanceState::running, 100);
  host.write_count(1);
  TaskRecorder task(page.statistics(0), TimePoint(seconds(1)));
  const auto run_cycle = [&](int number, Duration latency) {
    const TimePoint release{seconds(2) + number * milliseconds(1)};
    task.record({.release = release,
                 .start = release + latency,
                 .end = release + latency + Duration(700),
                 .interval = milliseconds(1)});
  };
  for (int i = 0; i < 1000; ++i) run_cycle(i, Duration(i % 100 == 0 ? 50'000 : 1'000));
  host.start_server();
  const auto sut = connect(domain);
  ASSERT_TRUE(sut->host("hosta", soon()));

  const auto report = sut->statistics("hosta", "line1", "Main", soon());

  ASSERT_TRUE(report) << report.error().describe();
  const plc_TaskStatistics& told = report->sample();
  EXPECT_EQ(told.cycles, 1000U);
  EXPECT_EQ(told.digits, 3U);
  EXPECT_EQ(told.slots_max, 1U);
  EXPECT_GT(told.elapsed_ns, 0);
  EXPECT_EQ(told.latency.min_ns, 1'000);
  EXPECT_EQ(told.latency.max_ns, 50'000);
  EXPECT_EQ(told.latency.average_ns, 1'490);
  EXPECT_EQ(told.release_jitter.max_ns, 49'000);
  EXPECT_EQ(told.release_jitter_histogram.total, 1000U);
  EXPECT_EQ(told.release_jitter_histogram.percentiles_ns[0], 0);
  EXPECT_EQ(told.release_jitter_histogram.percentiles_ns[4], 49'000);
  EXPECT_EQ(told.last_loss.lost, 0U);
  EXPECT_EQ(told.latency_histogram.total, 1000U);
  EXPECT_EQ(told.latency_histogram.percentiles_ns[0], 1'000);
  EXPECT_EQ(told.latency_histogram.percentiles_ns[3], 50'000);
  const auto bars = dds::parts_of(told.latency_histogram.bars);
  ASSERT_EQ(bars.size(), 2U);
  EXPECT_EQ(bars[0].count, 990U);
  EXPECT_EQ(told.execution_histogram.percentiles_ns[4], 700);
  EXPECT_EQ(told.period_jitter.min_ns, -49'000);
  EXPECT_EQ(told.jitter_negative_histogram.total, 10U);
  EXPECT_EQ(told.jitter_positive_histogram.total, 989U);

  ASSERT_TRUE(task.reset(TimePoint(seconds(9))));
  auto next = report;
  while (next->sample().recorded != 0) next = sut->statistics("hosta", "line1", "Main", soon());
  EXPECT_EQ(next->sample().cycles, 1000U);
  EXPECT_EQ(next->sample().latency_histogram.total, 0U);
  EXPECT_TRUE(dds::parts_of(next->sample().latency_histogram.bars).empty());
  EXPECT_GE(next->sample().since_unix_ns, told.since_unix_ns);
}

TEST(RemoteStatus, CountsChangesAndNoPresences) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  host.write_instance(0, "line1", InstanceState::running, 100);
  host.write_count(1);
  host.start_server();
  const auto sut = connect(domain);
  ASSERT_TRUE(sut->instances("hosta", soon()));
  // The host's load is a change, every 2 s: one of the looks is between two of them.
  constexpr auto kLook = milliseconds(200);
  const auto is_calm = [&] {
    const std::uint64_t before = sut->changes();
    std::size_t woken = 0;
    for (const TimePoint end = MonotonicClock::now() + kLook; MonotonicClock::now() < end; ++woken) {
      sut->wait_for_change(end);
      if (sut->changes() != before) return false;
    }
    return woken > 2;  // by presences
  };
  bool calm = false;
  for (const TimePoint end = soon(); !calm && MonotonicClock::now() < end;) calm = is_calm();
  EXPECT_TRUE(calm);

  const std::uint64_t before = sut->changes();
  host.write_instance(0, "line1", InstanceState::exception, 100);
  while (sut->changes() == before) sut->wait_for_change(soon());
  const std::uint64_t there = sut->changes();
  host.server().signal(SIGKILL);
  const TimePoint end = soon();
  while (sut->changes() == there && MonotonicClock::now() < end) {
    sut->wait_for_change(std::min(end, sut->next_silence()));
  }
  EXPECT_GT(sut->changes(), there) << "it is silent";
}

TEST(RemoteStatus, IsWaitedForUntilAnotherThreadWakesTheClient) {
  const OwnDomain domain;
  const auto sut = connect(domain);
  std::promise<void> woken;
  const std::jthread waits([&] {
    sut->wait_for_change(MonotonicClock::now() + 2 * kPatience);
    woken.set_value();
  });
  sut->wake();
  EXPECT_EQ(woken.get_future().wait_for(kPatience), std::future_status::ready);
  sut->wake();  // for the wait that follows
  const TimePoint end = soon();
  sut->wait_for_change(end);
  EXPECT_LT(MonotonicClock::now(), end);
}

TEST(RemoteStatus, OfAPageThatAStrangerWroteToHarmsNobody) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  InstancePage page = host.make_page("line1", "Main", 100);
  TaskCounters wild{};
  std::memset(static_cast<void*>(&wild), 0x80, sizeof wild);
  page.statistics(0).counters.write(wild);
  page.statistics(0)[TaskHistogram::latency].record(milliseconds(1));
  host.write_instance(0, "line1", InstanceState::running, 100);
  host.write_count(1);
  host.start_server();
  const auto sut = connect(domain);
  ASSERT_TRUE(sut->host("hosta", soon()));
  const auto report = sut->statistics("hosta", "line1", "Main", soon());
  ASSERT_TRUE(report) << report.error().describe();
  EXPECT_EQ(report->sample().cycles, 0x8080808080808080U);
}

// DDS lets any writer dispose of another one's sample. A reader that has not taken the sample does not learn
// the writer.
TEST(RemoteStatus, IsNotEndedByAStranger) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  host.write_instance(0, "line1", InstanceState::offline);
  host.write_count(1);
  host.start_server();
  const auto sut = connect(domain);
  const auto other = connect(domain);
  for (const auto& client : {&sut, &other}) {
    ASSERT_TRUE((*client)->host("hosta", soon()));
    ASSERT_EQ((*client)->instances("hosta", soon()).value().size(), 1U);
  }
  const dds::Entity stranger{dds_create_participant(domain.number(), nullptr, nullptr)};
  const auto topic = dds::make_topic(stranger.get(), dds::kInstanceStatus);
  const auto publisher = dds::make_publisher(stranger.get(), dds::status_partition("west"));
  const auto writer = dds::make_writer(publisher->get(), topic->get(), dds::qos_of(dds::kInstanceStatus));
  plc_InstanceStatus sample{};
  dds::copy_text(sample.host, "hosta");
  dds::copy_text(sample.instance, "line1");

  constexpr auto running = static_cast<std::uint32_t>(InstanceState::running);
  host.write_instance(0, "line1", InstanceState::running);
  while (other->instances("hosta", soon()).value().at(0).state != running) ::usleep(1000);
  ASSERT_EQ(dds_dispose(writer->get(), &sample), DDS_RETCODE_OK);

  const auto instances = sut->instances("hosta", soon());
  ASSERT_TRUE(instances) << instances.error().describe();
  ASSERT_EQ(instances->size(), 1U);
  EXPECT_EQ(instances->front().state, running);
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

// As after a pause of the host's process, or of the network, that was longer than the host's lease.
void lose_sight_of_hosts(ControlClient& client) {
  const dds_entity_t participant = client.participant()->entity.get();
  const auto subscriber = dds::make_subscriber(participant, dds::status_partition(dds::kAllHosts)).value();
  const auto topic = dds::make_topic(participant, dds::kPresence).value();
  const auto reader = dds::make_reader(subscriber.get(), topic.get(), dds::qos_of(dds::kPresence)).value();
  std::array<dds_instance_handle_t, 8> writers{};
  const auto hosts = [&] {
    const auto count = dds_get_matched_publications(reader.get(), writers.data(), writers.size());
    return std::span(writers).first(static_cast<std::size_t>(std::max(count, 0)));
  };
  const TimePoint end = soon();
  const auto wait_while = [&](const auto& condition) {
    while (condition() && MonotonicClock::now() < end) std::this_thread::sleep_for(milliseconds(1));
    ASSERT_FALSE(condition());
  };
  ASSERT_NO_FATAL_FAILURE(wait_while([&] { return hosts().size() != 1; }));
  const dds_instance_handle_t lost = writers.front();
  ASSERT_TRUE(plc_forget_participant(reader.get(), lost));
  // Not that there is none: the host announces itself again, as another writer.
  ASSERT_NO_FATAL_FAILURE(wait_while([&] { return std::ranges::find(hosts(), lost) != hosts().end(); }));
  // Until the host announces itself again the client takes notice.
  for (int i = 0; i < 40; ++i) {
    (void)client.changes();
    std::this_thread::sleep_for(milliseconds(5));
  }
}

TEST(RemoteStatus, IsWholeAgainAfterTheClientHasLostSightOfTheHost) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  host.write_instance(0, "line1", InstanceState::running, 4711);
  host.write_instance(1, "line2", InstanceState::offline);
  host.write_count(2);
  host.start_server();
  const auto sut = connect(domain);
  ASSERT_TRUE(sut->host("hosta", soon()));
  ASSERT_EQ(sut->instances("hosta", soon()).value().size(), 2U);

  ASSERT_NO_FATAL_FAILURE(lose_sight_of_hosts(*sut));
  host.write_count(1);
  ASSERT_TRUE(sut->host("hosta", soon()));
  std::size_t count = 0;
  for (const TimePoint end = soon(); count != 1 && MonotonicClock::now() < end;) {
    const auto instances = sut->instances("hosta", end);
    ASSERT_TRUE(instances) << instances.error().describe();
    count = instances->size();
  }
  EXPECT_EQ(count, 1U) << "the host has said nothing of line2 since it is seen again";

  const TimePoint limit = soon();
  const auto reply = sut->call({"hosta", plc_OPERATION_STOP, "line1", ""}, limit);
  ASSERT_TRUE(reply) << reply.error().describe();
  EXPECT_LT(MonotonicClock::now(), limit) << "it waits for a state of the host that it cannot see";
  EXPECT_EQ(sut->instances("hosta", soon()).value().at(0).state,
            static_cast<std::uint32_t>(InstanceState::stopped));
}

TEST(RemoteStatus, OfStatisticsGoesOnAfterTheClientHasLostSightOfTheHost) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  InstancePage page = host.make_page("line1", "Main", 100);
  host.write_instance(0, "line1", InstanceState::running, 100);
  host.write_count(1);
  TaskRecorder task(page.statistics(0), TimePoint(seconds(1)));
  const auto run_cycle = [&](int number) {
    const TimePoint release{seconds(2) + number * milliseconds(1)};
    task.record(
        {.release = release, .start = release, .end = release + Duration(700), .interval = milliseconds(1)});
  };
  run_cycle(0);
  host.start_server();
  const auto sut = connect(domain);
  ASSERT_TRUE(sut->host("hosta", soon()));
  ASSERT_EQ(sut->statistics("hosta", "line1", "Main", soon()).value().sample().cycles, 1U);

  ASSERT_NO_FATAL_FAILURE(lose_sight_of_hosts(*sut));
  run_cycle(1);

  std::uint64_t cycles = 0;
  for (const TimePoint end = soon(); cycles != 2 && MonotonicClock::now() < end;) {
    const auto report = sut->statistics("hosta", "line1", "Main", end);
    ASSERT_TRUE(report) << report.error().describe();
    cycles = report->sample().cycles;
    sut->wait_for_change(MonotonicClock::now() + milliseconds(20));
  }
  EXPECT_EQ(cycles, 2U);
}

TEST(RemoteStatus, OfADomainWithoutHostsIsEmpty) {
  const OwnDomain domain;
  EXPECT_TRUE(connect(domain)->hosts(MonotonicClock::now() + milliseconds(100)).empty());
}

}  // namespace
}  // namespace plchost
