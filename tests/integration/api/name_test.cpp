#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "api/client/control_client.hpp"
#include "api/client/status_count.hpp"
#include "api/control/exit_codes.hpp"
#include "tests/integration/api/test_host.hpp"
#include "tests/support/further_round.hpp"

namespace plchost {
namespace {

/// The time for the first question is too short on a machine that stands still.
constexpr const char* kAsksForLong = "--name-refused";

// Two hosts that have one name, in one domain: each has a pool, a run directory and a plchost-dds of its own.
class HostName : public testing::Test {
 protected:
  void until(const std::function<bool()>& happened) {
    const TimePoint end = soon();
    while (!happened() && MonotonicClock::now() < end) sut_->wait_for_change(MonotonicClock::now() + kLook);
    ASSERT_TRUE(happened());
  }
  /// Which of the two the clients see: the number of its instances.
  [[nodiscard]] std::uint32_t instances_seen() {
    const auto host = sut_->host("hosta", soon());
    return host ? count_of<plc_InstanceStatus>(host->status).value_or(0) : 0;
  }

  static constexpr Duration kLook = std::chrono::milliseconds(10);
  OwnDomain domain_;
  TestHost first_{domain_, "hosta"};
  TestHost second_{domain_, "hosta"};
  std::unique_ptr<ControlClient> sut_ = connect(domain_);
};

/// Made when the first claim of that host is lost.
std::string mark_of(const TestHost& host) {
  return host.run_directory() + "/lost";
}

/// Its claim is lost for so long.
void start_behind_lossy_network(TestHost& host, std::chrono::milliseconds lost,
                                std::vector<std::string> more) {
  ::setenv("LD_PRELOAD", LOSSY_NETWORK, 1);  // NOLINT(concurrency-mt-unsafe): the child has not started
  ::setenv("LOST_TEXT", host.run_directory().c_str(), 1);        // NOLINT(concurrency-mt-unsafe)
  ::setenv("LOST_MS", std::to_string(lost.count()).c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
  ::setenv("LOST_MARK", mark_of(host).c_str(), 1);               // NOLINT(concurrency-mt-unsafe)
  host.start_server(std::move(more));
  ::unsetenv("LD_PRELOAD");  // NOLINT(concurrency-mt-unsafe)
  ::unsetenv("LOST_TEXT");   // NOLINT(concurrency-mt-unsafe)
  ::unsetenv("LOST_MS");     // NOLINT(concurrency-mt-unsafe)
  ::unsetenv("LOST_MARK");   // NOLINT(concurrency-mt-unsafe)
}

void write_instances(TestHost& host, std::uint32_t count) {
  for (std::uint32_t i = 0; i < count; ++i) {
    host.write_instance(i, "line" + std::to_string(i), InstanceState::running);
  }
  host.write_count(count);
}

// An older host that asks is refused, while the claim of the one that serves is lost for so long. It knows
// that a claim is to come if DDS has found its writer before the asking ends, after 2 s. A machine that needs
// longer for that lets both serve, and another pair has to show it.
void refuse_an_older_one(std::chrono::milliseconds lost) {
  constexpr std::chrono::milliseconds kFoundSoon(1500);
  constexpr int kRounds = 4;
  for (int round = 1; round <= kRounds; ++round) {
    const OwnDomain domain;
    TestHost first(domain, "hosta");
    TestHost second(domain, "hosta");
    write_instances(first, 1);
    const auto client = connect(domain);
    start_behind_lossy_network(first, lost, {"--name-since", "2000"});
    ASSERT_TRUE(client->instances("hosta", soon()));
    const TimePoint begin = MonotonicClock::now();
    second.start_server({"--name-since", "1000", kAsksForLong});
    while (!std::filesystem::exists(mark_of(first)) && MonotonicClock::now() < begin + kPatience) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    if (MonotonicClock::now() - begin < kFoundSoon) {
      EXPECT_EQ(second.server().wait(), kExitNameTaken);
      const auto instances = client->instances("hosta", soon());
      ASSERT_TRUE(instances);
      EXPECT_EQ(instances->size(), 1U);
      return;
    }
    say_further_round("DDS has found the other host too late");
  }
  FAIL() << "in none of the rounds, DDS has found the other host in time";
}

TEST_F(HostName, IsRefusedToWhoComesLaterWhoThenShowsNothing) {
  write_instances(first_, 1);
  write_instances(second_, 2);
  first_.start_server();
  until([&] { return instances_seen() == 1; });
  const std::uint64_t epoch = sut_->host("hosta", soon())->epoch;

  second_.start_server({kAsksForLong});
  EXPECT_EQ(second_.server().wait(), kExitNameTaken);
  EXPECT_EQ(instances_seen(), 1U);
  EXPECT_EQ(sut_->host("hosta", soon())->epoch, epoch) << "the first one goes on";
  until([&] { return !dds::text_of(sut_->host("hosta", soon())->status.rival).empty(); });
}

// A network that loses datagrams is as slow as a busy machine can be.
TEST_F(HostName, IsToldOfARivalThatHasToSendItsClaimSeveralTimes) {
  first_.start_server();
  until([&] { return sut_->host("hosta", MonotonicClock::now()).has_value(); });
  start_behind_lossy_network(second_, std::chrono::milliseconds(700), {kAsksForLong});
  EXPECT_EQ(second_.server().wait(), kExitNameTaken);
  until([&] { return !dds::text_of(sut_->host("hosta", soon())->status.rival).empty(); });
}

TEST_F(HostName, IsWaitedForIfItsClaimIsLate) {
  refuse_an_older_one(std::chrono::milliseconds(2500));  // it is asked for 2 s
}

TEST_F(HostName, IsNotLostToAnOlderOneThatOnlyAsks) {
  refuse_an_older_one(std::chrono::milliseconds(0));
}

// As when a network that was divided becomes one again.
TEST_F(HostName, OfTwoThatServeBelongsToTheOlderWhoTellsAllAnew) {
  write_instances(first_, 1);
  write_instances(second_, 2);
  first_.start_server({"--name-since", "1000", "--name-held"});
  until([&] { return instances_seen() == 1; });
  second_.start_server({"--name-since", "2000", "--name-held"});

  EXPECT_EQ(second_.server().wait(), kExitNameTaken);
  EXPECT_EQ(first_.server().wait(), 0) << "its manager starts it again";
  first_.start_server({"--name-since", "1000", "--name-held"});
  until([&] { return instances_seen() == 1; });
  EXPECT_TRUE(sut_->instances("hosta", soon()));
}

TEST_F(HostName, IsFreeAgainWhenItsHostHasGone) {
  write_instances(second_, 2);
  first_.start_server();
  until([&] { return sut_->host("hosta", MonotonicClock::now()).has_value(); });
  first_.server().signal(SIGTERM);
  EXPECT_EQ(first_.server().wait(), 0);

  second_.start_server();
  until([&] { return instances_seen() == 2; });
}

TEST_F(HostName, IsItsOwnAfterACrash) {
  write_instances(first_, 1);
  first_.start_server();
  until([&] { return instances_seen() == 1; });
  const std::uint64_t before = sut_->host("hosta", soon())->epoch;
  first_.server().signal(SIGKILL);
  // With what is left of the killed one still in the domain, and without any word of it on the command line.
  first_.server().wait();
  first_.start_server();
  until([&] {
    const auto host = sut_->host("hosta", MonotonicClock::now());
    return host && host->epoch > before;
  });
}

TEST_F(HostName, OfTwoThatAskAtOnceBelongsToOne) {
  first_.start_server({"--name-since", "1000", kAsksForLong});
  second_.start_server({"--name-since", "2000", kAsksForLong});
  EXPECT_EQ(second_.server().wait(), kExitNameTaken);
  until([&] { return sut_->host("hosta", MonotonicClock::now()).has_value(); });
}

}  // namespace
}  // namespace plchost
