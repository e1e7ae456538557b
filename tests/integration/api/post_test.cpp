#include <thread>

#include <gmock/gmock.h>

#include "api/client/control_client.hpp"
#include "api/dds/text.hpp"
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

  const auto report = sut->post_event({"hosta", 0, "line1", "ready"}, 5000, Duration::zero(), kPatience);

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

  const auto report = sut->post_event({"hosta", 0, "line1", "ready"}, 3, Duration::zero(), kPatience);

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

  const auto report = sut->post_event({"hosta", 0, "line1", "redy"}, 2, Duration::zero(), kPatience);

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

  const auto bad = sut->post_event({"hosta", 0, "", ""}, 1, Duration::zero(), kPatience);
  const auto good = sut->post_event({"hosta", 0, "line1", "ready"}, 1, Duration::zero(), kPatience);

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

  const auto counted =
      sut->post_event({"hosta", 0, "line1", longest + "eeeee"}, 1, Duration::zero(), kPatience);
  const auto fast = sut->post_one("hosta", "line1", longest + "e");
  const auto fits = sut->post_event({"hosta", 0, "line1", longest}, 1, Duration::zero(), kPatience);

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
  const auto report = sut->post_event({"hosta", 0, "line1", "ready"}, kPosts, Duration::zero(), kPatience);
  killer.join();

  ASSERT_TRUE(report) << report.error().describe();
  EXPECT_EQ(report->unacknowledged, 0U);
  EXPECT_EQ(report->accepted, kPosts);
  // The window of PostLedger: at most one repeated post for each kill, and none lost.
  EXPECT_GE(event.counted().count(), kPosts);
  EXPECT_LE(event.counted().count(), kPosts + kKills);
}

TEST(RemotePost, GoesOnWhileAnotherClientIsStopped) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  const PoolEvent slow = host.add_event("line1", "slow");
  const PoolEvent fast = host.add_event("line1", "fast");
  host.start_server();
  const Child stopped(
      PLCCTL_PROGRAM,
      {"--domain", std::to_string(domain.number()), "post", "event", "line1/slow", "--count", "1000000"},
      "/dev/null");
  while (slow.counted().count() < 100) std::this_thread::sleep_for(milliseconds(5));
  stopped.signal(SIGSTOP);
  const auto sut = connect(domain);

  const auto report = sut->post_event({"hosta", 0, "line1", "fast"}, 5000, Duration::zero(), kPatience);

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
  ASSERT_TRUE(sut->post_event({"hosta", 0, "line1", "ready"}, 1, Duration::zero(), kPatience));

  for (int i = 0; i < 100; ++i) ASSERT_TRUE(sut->post_one("hosta", "line1", "ready"));

  while (event.counted().count() < 101) std::this_thread::sleep_for(milliseconds(1));
  EXPECT_EQ(event.counted().count(), 101U);
}

TEST(RemotePost, ToAHostThatIsNotThereEndsWithNoAnswer) {
  const OwnDomain domain;
  const auto sut = connect(domain);

  const auto report =
      sut->post_event({"nohost", 0, "line1", "ready"}, 1, Duration::zero(), milliseconds(200));

  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::timed_out);
  EXPECT_THAT(report.error().message, testing::HasSubstr("nohost"));
}

}  // namespace
}  // namespace plchost
