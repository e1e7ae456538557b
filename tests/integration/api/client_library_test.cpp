// The client library as its users see it: by plchost_client.hpp, from libplchost-client.so.
#include "tests/integration/api/client_library.hpp"

#include <atomic>
#include <condition_variable>
#include <future>
#include <memory>
#include <thread>
#include <utility>

#include <dds/dds.h>
#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/pages/log_ring.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

TEST_F(ClientLibrary, IsOneParticipantOfTheDomain) {
  Client sut(options());
  std::promise<void> told;
  const auto watch =
      sut.watch_instances("hosta", [&, first = true](const Client::Instance& /*instance*/) mutable {
        if (std::exchange(first, false)) told.set_value();
      });
  EXPECT_EQ(sut.instances("hosta").size(), 1U);
  told.get_future().wait();
  EXPECT_EQ(dds_lookup_participant(domain_.number(), nullptr, 0), 1) << "for its calls and its watches";
}

TEST_F(ClientLibrary, ReadsAnyStatusTopicByTheNamesOfTheContract) {
  Client sut(options());
  EXPECT_THAT(Client::topics(), testing::IsSupersetOf({"instance", "task", "event", "writer", "exception"}));
  const auto instances = sut.status("instance", "hosta");
  ASSERT_EQ(instances.size(), 1U);
  EXPECT_THAT(instances.front(),
              testing::IsSupersetOf({std::pair<std::string, Client::Value>("instance", std::string("line1")),
                                     std::pair<std::string, Client::Value>("state", std::string("running")),
                                     std::pair<std::string, Client::Value>("pid", 4711LL),
                                     std::pair<std::string, Client::Value>("autostart", true)}));
  EXPECT_THAT(sut.status("event").front(),
              testing::Contains(std::pair<std::string, Client::Value>("bound_tasks", 1ULL)));
  const ClientError unknown = error_of([&] { (void)sut.status("weather"); });
  EXPECT_EQ(unknown.code(), ClientError::invalid_argument);
  EXPECT_THAT(unknown.what(), HasSubstr("no status topic 'weather'; there are: "));
}

TEST_F(ClientLibrary, KnowsEachCommandOfTheTable) {
  Client sut(options());
  std::vector<std::string> names;
  for (const auto& operation : Client::operations()) names.push_back(operation.name);
  EXPECT_THAT(names,
              testing::IsSupersetOf({"start", "reset cold", "reset statistics", "rollback application"}));
  EXPECT_THAT(names, testing::Not(testing::Contains("shutdown")));
  host_.answer_with({0, ErrorCode::ok, "done by the manager"});
  EXPECT_EQ(sut.command("reset statistics", "hosta", "line1", "Main"), "done by the manager");
  EXPECT_EQ(host_.requests().back().verb, ControlVerb::reset_statistics);
  EXPECT_EQ(host_.requests().back().argument, "Main");
  std::promise<Client::Outcome> told;
  sut.command("stop", "hosta", "line1", "", [&](const Client::Outcome& outcome) { told.set_value(outcome); });
  EXPECT_EQ(told.get_future().get().text, "done by the manager");
  const ClientError unknown = error_of([&] { (void)sut.command("make coffee", "hosta", "line1"); });
  EXPECT_EQ(unknown.code(), ClientError::invalid_argument);
  EXPECT_THAT(unknown.what(), HasSubstr("no command 'make coffee'; there are: start,"));
}

TEST_F(ClientLibrary, TellsOfAnObjectOfAnotherTypeByTheCodeOfTheContract) {
  const auto slots = ObjectPool::attach(host_.pool_name()).value().create_semaphore("line1/slots", 1).value();
  Client sut(options());
  const ClientError refused = error_of([&] { (void)sut.post("hosta", "line1/slots"); });
  EXPECT_EQ(refused.code(), ClientError::wrong_type);
  EXPECT_THAT(refused.what(), HasSubstr("object 'line1/slots' is of type semaphore, not event"));
}

TEST_F(ClientLibrary, CountsThePostsOfManyThreadsExactlyOnce) {
  constexpr unsigned kThreads = 4;
  constexpr unsigned kPosts = 50;
  Client sut(options());
  std::atomic<unsigned> told{0};
  {
    std::vector<std::jthread> threads;
    for (unsigned i = 0; i < kThreads; ++i) {
      threads.emplace_back([&] {
        for (unsigned post = 0; post < kPosts; ++post) {
          EXPECT_EQ(sut.post("hosta", "line1/ready").accepted, 1U);
          sut.post("hosta", "line1/ready", [&](const Client::Outcome& outcome) { told += outcome ? 1 : 0; });
        }
      });
    }
  }
  EXPECT_EQ(sut.post({}, "line1/ready", 7).accepted, 7U);  // the only host; behind all that came before
  EXPECT_EQ(told, kThreads * kPosts);
  EXPECT_EQ(event_.counted().count(), 2U * kThreads * kPosts + 7U);
}

TEST_F(ClientLibrary, LetsACallbackUseTheClient) {
  Client sut(options());
  std::promise<std::size_t> hosts;
  sut.post("hosta", "line1/ready", [&](const Client::Outcome&) { hosts.set_value(sut.hosts().size()); });
  EXPECT_EQ(hosts.get_future().get(), 1U);

  std::promise<unsigned long long> posted;
  Client::Watch watch;
  watch = sut.watch_instances("hosta", [&](const Client::Instance& instance) {
    if (instance.pid == 4711) posted.set_value(sut.post(instance.host, "line1/ready").accepted);
  });
  EXPECT_EQ(posted.get_future().get(), 1U);
}

TEST_F(ClientLibrary, TellsEachChangeAndNothingAfterStop) {
  Client sut(options());
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::string> states;
  auto watch = sut.watch_instances({}, [&](const Client::Instance& instance) {
    const std::lock_guard lock(mutex);
    states.push_back(instance.name + " " + instance.state);
    changed.notify_all();
  });
  const auto until = [&](std::size_t count) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, kPatience, [&] { return states.size() >= count; });
  };
  ASSERT_TRUE(until(1));
  host_.write_instance(0, "line1", InstanceState::exception, 4711);
  ASSERT_TRUE(until(2));
  watch.stop();
  host_.write_instance(0, "line1", InstanceState::running, 4711);
  while (sut.instances("hosta").front().state != "running") continue;
  EXPECT_THAT(states, testing::ElementsAre("line1 running", "line1 exception"));
}

TEST_F(ClientLibrary, TellsOfWhatWasRemovedOnce) {
  Client sut(options());
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::string> told;
  const auto watch = sut.watch_instances("hosta", [&](const Client::Instance& instance) {
    const std::lock_guard lock(mutex);
    told.push_back(instance.name + (instance.removed ? " removed" : " there"));
    changed.notify_all();
  });
  const auto until = [&](const std::string& last) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, kPatience, [&] { return !told.empty() && told.back() == last; });
  };
  ASSERT_TRUE(until("line1 there"));
  host_.write_count(0);
  ASSERT_TRUE(until("line1 removed"));
  host_.write_count(1);
  ASSERT_TRUE(until("line1 there"));
  const std::lock_guard lock(mutex);
  EXPECT_THAT(told, testing::ElementsAre("line1 there", "line1 removed", "line1 there"));
}

TEST_F(ClientLibrary, HasTheHostReadItsConfigurationAgain) {
  Client sut(options());
  host_.answer_with({0, ErrorCode::ok, "[host] log_level changed, used at once\ninstance 'line2': new"});
  EXPECT_EQ(sut.reload("hosta"), "[host] log_level changed, used at once\ninstance 'line2': new");
  ASSERT_EQ(host_.requests().size(), 1U);
  EXPECT_EQ(host_.requests().front().verb, ControlVerb::reload_host);
  EXPECT_EQ(host_.requests().front().instance, "");
  host_.answer_with({0, ErrorCode::invalid_argument, "cell.toml:7: core is missing"});
  const auto refused = error_of([&] { (void)sut.reload(); });
  EXPECT_EQ(refused.code(), ClientError::invalid_argument);
  EXPECT_THAT(refused.what(), HasSubstr("cell.toml:7"));
}

TEST_F(ClientLibrary, ReadsWhatAnInstanceHasSaidAndReadsOn) {
  Client sut(options());
  EXPECT_TRUE(sut.logs("hosta", "line1").empty()) << "it has said nothing yet";
  auto ring = LogRing::open(host_.pool_name(), "line1").value();
  const auto say = [&](std::string_view text) {
    ring.add({.time_unix_ns = 1'800'000'000'250'000'000,
              .pid = 4711,
              .level = LogLevel::warning,
              .source = LogSource::application,
              .text = text});
  };
  say("valve 7 is stuck");
  say(std::string(1000, 'x'));
  const auto said = sut.logs({}, "line1");
  ASSERT_EQ(said.size(), 2U);
  EXPECT_EQ(said[0].host, "hosta");
  EXPECT_EQ(said[0].instance, "line1");
  EXPECT_EQ(said[0].text, "valve 7 is stuck");
  EXPECT_EQ(said[0].level, "warning");
  EXPECT_EQ(said[0].source, "application");
  EXPECT_EQ(said[0].pid, 4711);
  EXPECT_EQ(said[0].number, 1U);
  EXPECT_EQ(said[0].time.time_since_epoch(), std::chrono::nanoseconds(1'800'000'000'250'000'000));
  EXPECT_EQ(said[1].text, std::string(1000, 'x')) << "several records, one line";
  ASSERT_EQ(sut.logs("hosta", "line1", 1).size(), 1U);
  EXPECT_EQ(sut.logs("hosta", "line1", 1).front().number, said[1].number);

  EXPECT_TRUE(sut.logs("hosta", "line1", said[1]).empty());
  say("later");
  const auto later = sut.logs("hosta", "line1", said[1]);
  ASSERT_EQ(later.size(), 1U);
  EXPECT_EQ(later[0].text, "later");
  EXPECT_EQ(later[0].missing, 0U);
  LogRing::remove(host_.pool_name(), "line1");
  ring = LogRing::open(host_.pool_name(), "line1").value();
  say("of a new numbering");
  const auto anew = sut.logs("hosta", "line1", later[0]);
  LogRing::remove(host_.pool_name(), "line1");
  ASSERT_EQ(anew.size(), 1U);
  EXPECT_EQ(anew[0].text, "of a new numbering");
  EXPECT_NE(anew[0].stream, later[0].stream);
  EXPECT_EQ(error_of([&] { (void)sut.logs("hosta", "line9"); }).code(), ClientError::not_found);
}

TEST_F(ClientLibrary, LetsACallbackStopItsOwnWatch) {
  Client sut(options());
  std::promise<void> called;
  Client::Watch watch;
  std::promise<void> ready;
  watch = sut.watch_hosts([&, go = ready.get_future().share()](const Client::Host& host) {
    go.wait();
    EXPECT_EQ(host.name, "hosta");
    watch.stop();
    called.set_value();  // twice would throw
  });
  ready.set_value();
  called.get_future().get();
  host_.server().signal(SIGKILL);
  Client other(options(std::chrono::milliseconds(100)));
  while (!other.hosts().empty()) continue;
}

TEST_F(ClientLibrary, TellsWhenAHostFallsSilentAndAnswersAgain) {
  Client sut(options());
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<bool> answers;
  const auto watch = sut.watch_hosts([&](const Client::Host& host) {
    const std::lock_guard lock(mutex);
    if (answers.empty() || answers.back() != host.answers) answers.push_back(host.answers);
    changed.notify_all();
  });
  const auto until = [&](std::size_t count) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, kPatience, [&] { return answers.size() >= count; });
  };
  ASSERT_TRUE(until(1));
  host_.server().signal(SIGKILL);
  ASSERT_TRUE(until(2));
  host_.replace_server();
  ASSERT_TRUE(until(3));
  EXPECT_TRUE(answers[0]);
  EXPECT_FALSE(answers[1]);
  EXPECT_TRUE(answers[2]);
}

TEST_F(ClientLibrary, TellsCallsThatWereNotBegunThatItHasEnded) {
  std::vector<int> codes;
  for (const int timeout_ms : {300, 3'000, 20'000}) {  // it may end later than they do
    codes.clear();
    {
      Client sut(options(std::chrono::milliseconds(timeout_ms)));
      for (int i = 0; i < 3; ++i) {
        sut.post("nowhere", "line1/ready",
                 [&codes](const Client::Outcome& outcome) { codes.push_back(outcome.code); });
      }
    }
    ASSERT_EQ(codes.size(), 3U);
    if (codes.back() == ClientError::unavailable) break;
  }
  EXPECT_EQ(codes.back(), ClientError::unavailable);
}

TEST_F(ClientLibrary, LetsABoundedNumberOfPostsBeUnderWay) {
  constexpr unsigned kMost = 1024;
  std::atomic<unsigned> refused{0};
  std::atomic<unsigned> told{0};
  std::promise<void> go_on;
  {
    Client sut(options());
    std::promise<void> begun;
    sut.post("hosta", "line1/ready", [&](const Client::Outcome&) {
      begun.set_value();
      go_on.get_future().wait();
    });
    begun.get_future().wait();
    for (unsigned i = 1; i < kMost + 4; ++i) {  // the first one has ended, and is none of them
      sut.post("hosta", "line1/ready", [&](const Client::Outcome& outcome) {
        if (outcome.code == static_cast<int>(ErrorCode::full)) ++refused;
        ++told;
      });
    }
    EXPECT_EQ(refused, 3U) << "told within the call";
    EXPECT_EQ(told, 3U);
    go_on.set_value();
  }
  EXPECT_EQ(told, kMost + 3);
}

TEST_F(ClientLibrary, DoesTheCallsToAHostInTheirOrder) {
  constexpr int kCalls = 20;
  host_.answer_with({0, ErrorCode::ok, {}});
  {
    Client sut(options());
    (void)sut.instances("hosta");
    for (int i = 0; i < kCalls; ++i) {
      sut.command(i % 2 == 0 ? "start" : "set scheduler", "hosta", "line1", i % 2 == 0 ? "" : "CmpSchedule",
                  [&](const Client::Outcome& outcome) { EXPECT_TRUE(outcome) << outcome.text; });
    }
    (void)sut.start("hosta", "line1");  // waits for those before it
    ASSERT_EQ(host_.requests().size(), kCalls + 1U);
  }
  for (int i = 0; i < kCalls; ++i) {
    EXPECT_EQ(host_.requests()[static_cast<std::size_t>(i)].verb,
              i % 2 == 0 ? ControlVerb::start : ControlVerb::set_scheduler);
  }
}

TEST_F(ClientLibrary, WaitsForOneHostAndGoesOnWithAnother) {
  std::atomic<bool> told{false};
  Client patient(options());
  ASSERT_EQ(patient.instances("hosta").size(), 1U);
  constexpr auto kOther = std::chrono::seconds(5);
  Client sut(options(kOther));
  const TimePoint begun = MonotonicClock::now();
  sut.post("nowhere", "line1/ready", [&](const Client::Outcome& outcome) {
    EXPECT_EQ(outcome.code, ClientError::not_found) << outcome.text;
    told = true;
  });
  EXPECT_EQ(sut.instances("hosta").size(), 1U);
  EXPECT_EQ(sut.post("hosta", "line1/ready").accepted, 1U);
  EXPECT_TRUE(!told || MonotonicClock::now() - begun >= kOther)
      << "the call to the other host was waited for";
}

TEST_F(ClientLibrary, HasOneParticipantForAllClientsOfAProcess) {
  Client first(options());
  Client second(options());
  EXPECT_EQ(first.instances("hosta").size(), 1U);
  EXPECT_EQ(second.instances("hosta").size(), 1U);
  EXPECT_EQ(dds_lookup_participant(domain_.number(), nullptr, 0), 1);
  Client::Options other = options();
  other.peers = {"127.0.0.1"};
  const ClientError refused = error_of([&] { const Client sut(other); });
  EXPECT_EQ(refused.code(), ClientError::invalid_argument);
  EXPECT_THAT(refused.what(), HasSubstr("already, with another identity"));
}

TEST_F(ClientLibrary, DoesNothingAfterItWasClosed) {
  Client sut(options());
  sut.close();
  EXPECT_EQ(error_of([&] { sut.post("hosta", "line1/ready"); }).code(), ClientError::unavailable);
  std::atomic<int> code{0};
  sut.post("hosta", "line1/ready", [&](const Client::Outcome& outcome) { code = outcome.code; });
  EXPECT_EQ(code, ClientError::unavailable);
  const auto watch = sut.watch_hosts([](const Client::Host&) { ADD_FAILURE(); });
  sut.close();
  EXPECT_EQ(event_.counted().count(), 0U);
}

// Without any of its threads: a wait for them would never end.
TEST_F(ClientLibrary, IsNeitherUsedNorWaitedForInAChildOfFork) {
  auto sut = std::make_unique<Client>(options());
  auto watch = sut->watch_hosts([](const Client::Host&) {});
  EXPECT_EQ(sut->post("hosta", "line1/ready").accepted, 1U);
  const pid_t child = ::fork();
  if (child == 0) {
    ::alarm(20);
    const bool refused =
        error_of([&] { sut->post("hosta", "line1/ready"); }).code() == ClientError::unavailable &&
        error_of([&] { (void)sut->watch_hosts([](const Client::Host&) {}); }).code() ==
            ClientError::unavailable;
    watch.stop();
    sut->close();
    sut.reset();
    ::_exit(refused ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(sut->post("hosta", "line1/ready").accepted, 1U);
}

TEST_F(ClientLibrary, ThrowsWithTheCodeAndTextOfTheHost) {
  Client sut(options());
  const ClientError rejected = error_of([&] { sut.post("hosta", "line1/redy"); });
  EXPECT_EQ(rejected.code(), ClientError::not_found);
  EXPECT_THAT(rejected.what(), HasSubstr("line1/redy"));

  host_.answer_with({.number = 0, .code = ErrorCode::wrong_state, .text = "is stopped already"});
  const ClientError refused = error_of([&] { sut.stop("hosta", "line1"); });
  EXPECT_EQ(refused.code(), ClientError::wrong_state);
  EXPECT_THAT(refused.what(), HasSubstr("is stopped already"));
}

TEST_F(ClientLibrary, RefusesAtOnceWhatCannotBe) {
  Client::Options wrong = options();
  wrong.domain = 1000;
  EXPECT_EQ(error_of([&] { const Client sut(wrong); }).code(), ClientError::invalid_argument);
  wrong = options(std::chrono::milliseconds(0));
  EXPECT_THAT(error_of([&] { const Client sut(wrong); }).what(), HasSubstr("allowed are 1 to"));

  Client sut(options());
  EXPECT_EQ(error_of([&] { sut.post("hosta", "ready"); }).code(), ClientError::invalid_argument);
  EXPECT_EQ(error_of([&] { sut.post("ho sta", "line1/ready"); }).code(), ClientError::invalid_argument);
  EXPECT_EQ(error_of([&] { sut.start("hosta", "li/ne"); }).code(), ClientError::invalid_argument);
  EXPECT_EQ(error_of([&] { sut.post("hosta", "line1/ready", nullptr); }).code(),
            ClientError::invalid_argument);
  EXPECT_EQ(error_of([&] { (void)sut.watch_hosts(nullptr); }).code(), ClientError::invalid_argument);
  EXPECT_EQ(error_of([&] { (void)sut.watch_tasks("hosta", nullptr); }).code(), ClientError::invalid_argument);
  EXPECT_EQ(event_.counted().count(), 0U);
}

TEST_F(ClientLibrary, NamesTheHostsThatAnswerWhenTheWantedOneDoesNot) {
  int code = 0;
  std::string said;
  for (const int patience : {1, 5, 20}) {  // a machine that does not find one in a time gets a longer one
    Client sut(options(std::chrono::seconds(patience)));
    const ClientError error = error_of([&] { (void)sut.tasks("hostb"); });
    code = error.code();
    said = error.what();
    if (said.contains("hosta")) break;
  }
  EXPECT_EQ(code, ClientError::not_found);
  EXPECT_THAT(said, HasSubstr("hosta"));
}

}  // namespace
}  // namespace plchost
