#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "api/client/control_client.hpp"
#include "api/client/poster.hpp"
#include "api/dds/domain.hpp"
#include "api/dds/samples.hpp"
#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(RemotePost, CountsEachPostExactlyOnce) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  const PoolEvent event = host.add_event("line1", "ready");
  event.set_bound_tasks(1);
  host.start_server();
  const auto sut = connect(domain);

  const auto report = sut->post_event({"hosta", "line1", "ready"}, 5000, Duration::zero(), kPatience);

  ASSERT_TRUE(report) << report.error().describe();
  EXPECT_EQ(report->accepted, 5000U);
  EXPECT_EQ(report->no_task, 0U);
  EXPECT_EQ(report->rejected, 0U);
  EXPECT_EQ(event.counted().count(), 5000U);
}

TEST(RemotePost, SaysWhenNoTaskIsBound) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  const PoolEvent event = host.add_event("line1", "ready");
  host.start_server();
  const auto sut = connect(domain);

  const auto report = sut->post_event({"hosta", "line1", "ready"}, 3, Duration::zero(), kPatience);

  ASSERT_TRUE(report) << report.error().describe();
  EXPECT_EQ(report->accepted, 3U);
  EXPECT_EQ(report->no_task, 3U);
  EXPECT_EQ(event.counted().count(), 3U);
}

TEST(RemotePost, OfAnUnknownEventIsRejectedByName) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  host.start_server();
  const auto sut = connect(domain);

  const auto report = sut->post_event({"hosta", "line1", "redy"}, 2, Duration::zero(), kPatience);

  ASSERT_TRUE(report) << report.error().describe();
  EXPECT_EQ(report->accepted, 0U);
  EXPECT_EQ(report->rejected, 2U);
  EXPECT_EQ(report->rejected_code, ErrorCode::not_found);
  EXPECT_THAT(report->rejected_text, testing::HasSubstr("line1/redy"));
}

TEST(RemotePost, WithANameThatCannotBeIsRefusedAndTheNextOneGoesThrough) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  const PoolEvent event = host.add_event("line1", "ready");
  host.start_server();
  const auto sut = connect(domain);

  const auto bad = sut->post_event({"hosta", "", ""}, 1, Duration::zero(), kPatience);
  const auto good = sut->post_event({"hosta", "line1", "ready"}, 1, Duration::zero(), kPatience);

  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().code, ErrorCode::invalid_argument);
  ASSERT_TRUE(good);
  EXPECT_EQ(good->accepted, 1U);
  EXPECT_EQ(event.counted().count(), 1U);
}

// Cut to the bound, both names would be the event that is there.
TEST(RemotePost, ToALongerNameNeverReachesTheEventThatItBeginsWith) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  const std::string longest(kMaxEventName, 'e');
  const PoolEvent event = host.add_event("line1", longest);
  host.start_server();
  const auto sut = connect(domain);
  ASSERT_TRUE(sut->prepare_posts("hosta", MonotonicClock::now() + kPatience));

  const auto counted = sut->post_event({"hosta", "line1", longest + "eeeee"}, 1, Duration::zero(), kPatience);
  const auto fast = sut->post_one("hosta", "line1", longest + "e");
  const auto fits = sut->post_event({"hosta", "line1", longest}, 1, Duration::zero(), kPatience);

  ASSERT_FALSE(counted);
  EXPECT_EQ(counted.error().code, ErrorCode::invalid_argument);
  EXPECT_THAT(counted.error().message, testing::HasSubstr("1 to 50"));
  ASSERT_FALSE(fast);
  EXPECT_EQ(fast.error().code, ErrorCode::invalid_argument);
  ASSERT_TRUE(fits);
  EXPECT_EQ(fits->accepted, 1U);
  EXPECT_EQ(event.counted().count(), 1U);
}

TEST(RemotePost, SurvivesTheDeathOfTheServer) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  const PoolEvent event = host.add_event("line1", "ready");
  event.set_bound_tasks(1);
  host.start_server();
  const auto sut = connect(domain);
  constexpr std::uint64_t kPosts = 20'000;
  constexpr std::uint64_t kKills = 3;

  std::jthread killer([&] {
    for (std::uint64_t kill = 1; kill <= kKills; ++kill) {
      while (event.counted().count() < kill * kPosts / (kKills + 1))
        std::this_thread::sleep_for(milliseconds(1));
      host.replace_server();
    }
  });
  const auto report = sut->post_event({"hosta", "line1", "ready"}, kPosts, Duration::zero(), kPatience);
  killer.join();

  ASSERT_TRUE(report) << report.error().describe();
  EXPECT_EQ(report->unacknowledged, 0U);
  EXPECT_EQ(report->accepted, kPosts);
  EXPECT_EQ(event.counted().count(), kPosts);
}

TEST(RemotePost, GoesOnWhileAnotherClientIsStopped) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  const PoolEvent slow = host.add_event("line1", "slow");
  const PoolEvent fast = host.add_event("line1", "fast");
  host.start_server();
  const Child stopped(PLCCTL_PROGRAM,
                      {"--domain", std::to_string(domain.number()), "--timeout", "60", "post", "event",
                       "line1/slow", "--count", "1000000"},
                      "/dev/null");
  while (slow.counted().count() < 100) std::this_thread::sleep_for(milliseconds(5));
  stopped.signal(SIGSTOP);
  const auto sut = connect(domain);

  const auto report = sut->post_event({"hosta", "line1", "fast"}, 5000, Duration::zero(), kPatience);

  ASSERT_TRUE(report) << report.error().describe();
  EXPECT_EQ(report->accepted, 5000U);
  EXPECT_EQ(fast.counted().count(), 5000U);
}

TEST(RemotePost, WithoutAcknowledgementReachesTheEvent) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  const PoolEvent event = host.add_event("line1", "ready");
  host.start_server();
  const auto sut = connect(domain);
  ASSERT_TRUE(sut->prepare_posts("hosta", soon()));
  ASSERT_TRUE(sut->post_event({"hosta", "line1", "ready"}, 1, Duration::zero(), kPatience));

  for (int i = 0; i < 100; ++i) ASSERT_TRUE(sut->post_one("hosta", "line1", "ready"));

  while (event.counted().count() < 101) std::this_thread::sleep_for(milliseconds(1));
  EXPECT_EQ(event.counted().count(), 101U);
}

// It has no credits, as it is not repeated: DDS bounds what is under way.
TEST(RemotePost, WithoutAcknowledgementFailsWhenTheHostTakesNoMore) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  host.add_event("line1", "ready");
  host.start_server();
  const auto sut = connect(domain);
  ASSERT_TRUE(sut->prepare_posts("hosta", soon()));
  ASSERT_TRUE(sut->post_event({"hosta", "line1", "ready"}, 1, Duration::zero(), kPatience));

  host.server().signal(SIGSTOP);
  constexpr int kFarTooMany = 100'000;
  int posted = 0;
  Result<void> last;
  while (posted < kFarTooMany && (last = sut->post_one("hosta", "line1", "ready"))) ++posted;
  host.server().signal(SIGCONT);

  fmt::print("{} posts were under way\n", posted);
  EXPECT_GT(posted, 64) << "the credits of a source";
  ASSERT_LT(posted, kFarTooMany);
  EXPECT_EQ(last.error().code, ErrorCode::timed_out);
  const auto report = sut->post_event({"hosta", "line1", "ready"}, 1, Duration::zero(), kPatience);
  ASSERT_TRUE(report) << report.error().describe();
  EXPECT_EQ(report->accepted, 1U);
}

TEST(RemotePost, ThatNobodyWaitsForIsAcknowledgedNevertheless) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  host.start_server();
  dds::DomainOptions options;
  options.domain = domain.number();
  const auto opened = dds::open_domain(dds::Role::client, options).value();
  const dds::Entity participant(dds_create_participant(domain.number(), nullptr, nullptr));
  const auto events = dds::make_topic(participant.get(), dds::kEventPost).value();
  const auto acks = dds::make_topic(participant.get(), dds::kEventAck).value();
  const auto own =
      dds::make_subscriber(participant.get(),
                           dds::client_partition(dds::guid_of(participant.get()).hex(), dds::kAllHosts))
          .value();
  const auto reader = dds::make_reader(own.get(), acks.get(), dds::qos_of(dds::kEventAck)).value();
  auto sut = EventPoster::create(participant.get(), events.get(), "hosta").value();
  while (!sut.matched()) std::this_thread::sleep_for(milliseconds(1));

  for (int i = 0; i < 100; ++i) ASSERT_TRUE(sut.post_once("line1", "redy", {}));

  plc_EventAck told{};
  for (const TimePoint end = soon(); told.rejected < 100 && MonotonicClock::now() < end;) {
    dds::take_valid<plc_EventAck>(reader.get(), [&](const plc_EventAck& ack, const auto&) { told = ack; });
    std::this_thread::sleep_for(milliseconds(1));
  }
  EXPECT_EQ(dds::Guid::from(told.source), sut.source());
  EXPECT_EQ(told.rejected, 100U);
  EXPECT_EQ(told.sequence_number, 100U);
}

TEST(RemotePost, OfABatchPostsAllOrNone) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  const PoolEvent one = host.add_event("line1", "one");
  const PoolEvent two = host.add_event("line2", "two");
  host.start_server();
  const auto sut = connect(domain);

  const std::vector<EventId> good{{"line1", "one"}, {"line2", "two"}};
  const std::vector<EventId> bad{{"line1", "one"}, {"line2", "three"}};
  const auto all = sut->post_batch("hosta", good, kPatience);
  const auto none = sut->post_batch("hosta", bad, kPatience);
  const auto again = sut->post_batch("hosta", good, kPatience);

  ASSERT_TRUE(all) << all.error().describe();
  EXPECT_EQ(all->accepted, 1U);
  ASSERT_TRUE(none);
  EXPECT_EQ(none->rejected, 1U);
  EXPECT_THAT(none->rejected_text, testing::HasSubstr("line2/three"));
  ASSERT_TRUE(again);
  EXPECT_EQ(again->accepted, 1U);
  EXPECT_EQ(one.counted().count(), 2U);
  EXPECT_EQ(two.counted().count(), 2U);
}

TEST(RemotePost, OfABatchThatIsTooLargeIsRefusedAtOnce) {
  const OwnDomain domain;
  const auto sut = connect(domain);
  const std::vector<EventId> events(kMaxBatch + 1, EventId{"line1", "one"});
  EXPECT_EQ(sut->post_batch("hosta", events, kPatience).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(sut->post_batch("hosta", {}, kPatience).error().code, ErrorCode::invalid_argument);
}

TEST(RemotePost, WhoseRunIsAwaitedFailsWhenNoTaskIsBoundOrNoEventIsThere) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  const PoolEvent event = host.add_event("line1", "ready");
  host.start_server();
  const auto sut = connect(domain);

  const auto no_task = sut->post_and_await({"hosta", "line1", "ready"}, kPatience);
  const auto no_event = sut->post_and_await({"hosta", "line1", "redy"}, kPatience);

  ASSERT_FALSE(no_task);
  EXPECT_EQ(no_task.error().code, ErrorCode::not_found);
  EXPECT_THAT(no_task.error().message, testing::HasSubstr("no task"));
  EXPECT_EQ(event.counted().count(), 1U);
  ASSERT_FALSE(no_event);
  EXPECT_THAT(no_event.error().message, testing::HasSubstr("line1/redy"));
}

TEST(RemotePost, WhoseRunIsAwaitedWaitsForAnInstanceThatIsStarting) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  host.write_instance(0, "line1", InstanceState::starting, 4711);
  host.write_count(1);
  host.start_server();
  const auto sut = connect(domain);
  const auto in_vain = sut->post_and_await({"hosta", "line1", "ready"}, milliseconds(500));
  ASSERT_FALSE(in_vain);
  EXPECT_NE(in_vain.error().code, ErrorCode::not_found) << in_vain.error().describe();
  const auto watcher = connect(domain);
  // Ends once the host has rejected posts that came after this began.
  const auto until_more_rejected = [&] {
    const TimePoint end = soon();
    (void)watcher->call({"hosta", plc_OPERATION_READ_CLOCK, "", ""}, end);  // the status is of now, then
    const auto rejected = [&] {
      const auto writers = watcher->writers("hosta", end);
      return writers && !writers->empty() ? writers->front().rejected : 0;
    };
    const std::uint64_t before = rejected();
    while (rejected() < before + 2 && MonotonicClock::now() < end) watcher->wait_for_change(end);
  };
  const std::jthread instance([&] {
    until_more_rejected();
    host.add_event("line1", "ready");
    until_more_rejected();
    host.write_instance(0, "line1", InstanceState::stopped, 4711);
  });

  const auto told = sut->post_and_await({"hosta", "line1", "ready"}, kPatience);

  ASSERT_FALSE(told);
  EXPECT_THAT(told.error().message, testing::HasSubstr("no task was bound"))
      << "it was told after the start, which ended without a task that runs";
}

// Waits until what the host tells of the writers is so, and returns it.
template <class Condition>
std::vector<plc_WriterStatus> writers_when(ControlClient& client, Condition condition) {
  for (;;) {
    auto writers = client.writers("hosta", soon()).value();
    if (condition(writers)) return writers;
    client.wait_for_change(soon());
  }
}

TEST(RemotePost, IsCountedForItsWriterAndForAllTogether) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  host.add_event("line1", "ready").set_bound_tasks(1);
  host.start_server();
  const auto one = connect(domain);
  ASSERT_TRUE(one->post_event({"hosta", "line1", "ready"}, 30, Duration::zero(), kPatience));
  {
    const auto other = connect(domain);
    ASSERT_TRUE(other->post_event({"hosta", "line1", "redy"}, 5, Duration::zero(), kPatience));
    // Not what was received: that may be more, as what is not acknowledged soon is sent again.
    const auto done = [](const plc_WriterStatus& writer) { return writer.delivered + writer.rejected; };
    const auto writers = writers_when(*one, [&](const std::vector<plc_WriterStatus>& told) {
      return told.size() == 3 && done(told[0]) == 35 && done(told[1]) + done(told[2]) == 35;
    });
    EXPECT_EQ(writers[0].delivered, 30U);
    EXPECT_EQ(writers[0].rejected, 5U);
    EXPECT_EQ(writers[1].delivered + writers[2].delivered, 30U);
    EXPECT_TRUE(writers[1].present && writers[2].present);
  }
  const auto left = writers_when(*one, [](const std::vector<plc_WriterStatus>& writers) {
    return std::ranges::count_if(writers, [](const auto& writer) { return writer.present; }) == 1;
  });
  EXPECT_EQ(left.size(), 3U) << "it is still shown";
}

TEST(RemotePost, ToAHostThatIsNotThereEndsWithNoAnswer) {
  const OwnDomain domain;
  const auto sut = connect(domain);

  const auto report = sut->post_event({"nohost", "line1", "ready"}, 1, Duration::zero(), milliseconds(200));

  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::timed_out);
  EXPECT_THAT(report.error().message, testing::HasSubstr("nohost"));
}

}  // namespace
}  // namespace plchost
