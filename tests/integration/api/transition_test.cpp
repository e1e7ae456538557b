// The changes of state of instances, as a client of another host sees them.
#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "api/client/control_client.hpp"
#include "api/dds/text.hpp"
#include "shm/pages/transition_ring.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

using ::testing::ElementsAre;
using ::testing::ElementsAreArray;

/// Instance, number and reason of each that has come, until `count` of them are there.
class Witness {
 public:
  explicit Witness(const OwnDomain& domain) : client_(connect(domain)) { look(); }
  void look() {
    auto news = client_->transitions();
    ASSERT_TRUE(news) << news.error().describe();
    for (const TransitionView& view : *news) {
      EXPECT_EQ(view.missed, 0U);
      seen_.push_back(std::string(dds::text_of(view.sample.instance)) + " " +
                      std::to_string(view.sample.sequence_number) + " " +
                      std::string(dds::text_of(view.sample.reason)));
    }
  }
  void look_until(std::size_t count) {
    const TimePoint deadline = soon();
    while (seen_.size() < count && MonotonicClock::now() < deadline) {
      look();
      client_->wait_for_change(MonotonicClock::now() + std::chrono::milliseconds(10));
    }
  }
  /// Takes what has come until the host's word is that this was all.
  void look_until_complete(const TestHost& host) {
    for (const TimePoint deadline = soon(); MonotonicClock::now() < deadline;) {
      const auto complete = client_->has_all_transitions(host.name(), deadline);
      ASSERT_TRUE(complete) << complete.error().describe();
      if (*complete) return;
      look();
    }
    FAIL() << "never complete";
  }
  [[nodiscard]] std::size_t size() const { return seen_.size(); }
  /// Of one instance, in the order in which they came.
  [[nodiscard]] std::vector<std::string> of(const std::string& instance) const {
    std::vector<std::string> found;
    for (const std::string& line : seen_) {
      if (line.starts_with(instance + " ")) found.push_back(line);
    }
    return found;
  }

 private:
  std::unique_ptr<ControlClient> client_;
  std::vector<std::string> seen_;
};

/// A life of two instances, and what is to be seen of it.
class Script {
 public:
  explicit Script(TestHost& host)
      : first_(host.make_page("line1", "Main", 100)),
        second_(host.make_page("line2", "Main", 200)),
        rings_{TransitionRing::open(host.pool_name(), "line1").value(),
               TransitionRing::open(host.pool_name(), "line2").value()} {
    host.write_instance(0, "line1", InstanceState::running, 100);
    host.write_instance(1, "line2", InstanceState::running, 200);
    host.write_count(2);
  }
  void add(std::size_t instance, const std::string& reason) {
    rings_.at(instance).add(TransitionSource::application, 1, 2, 100, reason);
    const std::string name = "line" + std::to_string(instance + 1);
    auto& lines = expected_.at(instance);
    lines.push_back(name + " " + std::to_string(lines.size() + 1) + " " + reason);
  }
  [[nodiscard]] const std::vector<std::string>& expected(std::size_t instance) const {
    return expected_.at(instance);
  }
  [[nodiscard]] std::size_t size() const { return expected_[0].size() + expected_[1].size(); }

 private:
  InstancePage first_;
  InstancePage second_;
  std::array<TransitionRing, 2> rings_;
  std::array<std::vector<std::string>, 2> expected_;
};

TEST(RemoteTransitions, ComeEachOnceAndInOrderOverAllEndsOfTheServer) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  Script script(host);
  script.add(0, "before the server");
  script.add(1, "before the server");
  host.start_server();
  Witness sut(domain);
  sut.look_until(script.size());
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 15; ++i) {
      script.add(0, "round " + std::to_string(round));
      if (i % 3 == 0) script.add(1, "round " + std::to_string(round));
      if (i % 5 == 0) sut.look();
    }
    host.replace_server();
    sut.look_until(script.size());
  }
  EXPECT_THAT(sut.of("line1"), ElementsAreArray(script.expected(0)));
  EXPECT_THAT(sut.of("line2"), ElementsAreArray(script.expected(1)));
}

// The manager makes a ring anew that a stranger has damaged or taken away.
TEST(RemoteTransitions, ComeFromTheRingThatTakesThePlaceOfAnother) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  Script script(host);
  script.add(0, "before");
  host.start_server();
  Witness sut(domain);
  sut.look_until(1);
  TransitionRing::remove(host.pool_name(), "line1");
  auto fresh = TransitionRing::open(host.pool_name(), "line1");
  ASSERT_TRUE(fresh);
  fresh->add(TransitionSource::application, 1, 2, 100, "behind");
  sut.look_until(2);
  EXPECT_THAT(sut.of("line1"), ElementsAre("line1 1 before", "line1 1 behind"));
}

TEST(RemoteTransitions, AreCompleteWhenTheHostSaysSoAndNotBefore) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  Script script(host);
  host.start_server();
  {
    Witness none(domain);
    none.look_until_complete(host);
    EXPECT_EQ(none.size(), 0U);
  }
  for (int i = 0; i < 64; ++i) {  // as many as are kept
    script.add(0, "before the client");
    if (i % 4 == 0) script.add(1, "before the client");
  }
  Witness early(domain);
  early.look_until(script.size());
  for (int round = 0; round < 5; ++round) {
    if (round == 3) host.replace_server();
    Witness sut(domain);
    sut.look_until_complete(host);
    EXPECT_THAT(sut.of("line1"), ElementsAreArray(script.expected(0))) << "round " << round;
    EXPECT_THAT(sut.of("line2"), ElementsAreArray(script.expected(1))) << "round " << round;
  }
}

TEST(RemoteTransitions, AreListedAllOfThemByPlcctl) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  Script script(host);
  for (int i = 0; i < 60; ++i) script.add(0, "before the server");
  for (int i = 0; i < 20; ++i) script.add(1, "before the server");
  host.start_server();
  const auto count = [&](std::vector<std::string> arguments) {
    const auto result = run_plcctl(domain.number(), std::move(arguments));
    EXPECT_EQ(result.code, 0) << result.errors;
    return nlohmann::json::parse(result.output).size();
  };
  for (int round = 0; round < 5; ++round) {
    EXPECT_EQ(count({"list", "transitions", "--json"}), 80U);
    EXPECT_EQ(count({"list", "transitions", "line2", "--json"}), 20U);
  }
}

TEST(RemoteTransitions, OfThePastAreSeenByAClientThatComesLate) {
  const OwnDomain domain;
  TestHost host(domain, "hosta");
  Script script(host);
  for (int i = 0; i < 5; ++i) script.add(0, "before the client");
  host.start_server();
  Witness early(domain);
  early.look_until(script.size());
  Witness sut(domain);
  sut.look_until(script.size());
  script.add(0, "after both");
  early.look_until(script.size());
  sut.look_until(script.size());
  EXPECT_THAT(sut.of("line1"), ElementsAreArray(script.expected(0)));
  EXPECT_THAT(early.of("line1"), ElementsAreArray(script.expected(0)));
}

}  // namespace
}  // namespace plchost
