// The order of the calls of a client, and of its callbacks.
#include <algorithm>
#include <atomic>
#include <fstream>
#include <future>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "tests/integration/api/client_library.hpp"

namespace plchost {
namespace {

constexpr unsigned kMostCalls = 1024;

class ClientOrder : public ClientLibrary {
 protected:
  ClientOrder() {
    host_.answer_with({0, ErrorCode::ok, "done"});
    std::ofstream(file_) << std::string(100'000, 'x');
  }
  [[nodiscard]] bool has_come(ControlVerb verb) {
    const auto requests = host_.requests();
    return std::ranges::find(requests, verb, &ControlRequest::verb) != requests.end();
  }
  [[nodiscard]] std::vector<std::string> arguments() {
    std::vector<std::string> all;
    for (const ControlRequest& request : host_.requests()) all.push_back(request.argument);
    return all;
  }

  const std::string file_ = host_.run_directory() + "/sent.so";
};

// Whether there is only one host is known later than that there is this one.
TEST_F(ClientOrder, OfCallsToOneHostIsKeptWhetherTheyNameItOrNot) {
  constexpr int kCalls = 12;
  std::vector<std::string> expected;
  Client sut(options());
  for (int i = 0; i < kCalls; ++i) {
    expected.push_back(fmt::format("Task{}", i));
    sut.command("reset statistics", i % 3 == 0 ? "" : "hosta", "line1", expected.back(),
                [](const Client::Outcome& outcome) { EXPECT_TRUE(outcome) << outcome.text; });
  }
  expected.emplace_back("Last");
  (void)sut.command("reset statistics", "hosta", "line1", "Last");
  EXPECT_EQ(arguments(), expected);
}

TEST_F(ClientOrder, OfCallsToAHostThatComesLaterIsKept) {
  TestHost late(domain_, "hostb");
  late.write_instance(0, "line1", InstanceState::running, 4711);
  late.write_count(1);
  late.answer_with({0, ErrorCode::ok, "done"});
  std::vector<std::string> expected;
  Client sut(options());
  for (int i = 0; i < 12; ++i) {
    expected.push_back(fmt::format("Task{}", i));
    sut.command("reset statistics", "hostb", "line1", expected.back(),
                [](const Client::Outcome& outcome) { EXPECT_TRUE(outcome) << outcome.text; });
  }
  EXPECT_EQ(sut.post("hosta", "line1/ready").accepted, 1U) << "a host that is there is not waited for";
  late.start_server();
  expected.emplace_back("Last");
  (void)sut.command("reset statistics", "hostb", "line1", "Last");
  std::vector<std::string> arguments;
  for (const ControlRequest& request : late.requests()) arguments.push_back(request.argument);
  EXPECT_EQ(arguments, expected);
}

TEST_F(ClientOrder, DoesNotAddUpTheTimeoutsOfCallsToAHostThatDoesNotCome) {
  constexpr unsigned kCalls = 100;  // 50 s, one after the other
  std::atomic<unsigned> told{0};
  std::atomic<unsigned> not_found{0};
  const TimePoint end = soon();
  Client sut(options(std::chrono::milliseconds(500)));
  for (unsigned i = 0; i < kCalls; ++i) {
    sut.post("nowhere", "line1/ready", [&](const Client::Outcome& outcome) {
      not_found += outcome.code == ClientError::not_found ? 1 : 0;
      ++told;
    });
  }
  while (told < kCalls && MonotonicClock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(not_found, kCalls);
}

TEST_F(ClientOrder, IsKeptByACallbackThatWaitsForItsLastCall) {
  Client sut(options());
  std::promise<void> ended;
  sut.post("hosta", "line1/ready", [&](const Client::Outcome&) {
    sut.command("reset statistics", "hosta", "line1", "First", [](const Client::Outcome&) {});
    (void)sut.command("reset statistics", "hosta", "line1", "Second");
    ended.set_value();
  });
  ended.get_future().wait();
  EXPECT_THAT(arguments(), testing::ElementsAre("First", "Second"));
}

TEST_F(ClientOrder, OfCallbacksIsOneAfterTheOtherAlsoWhenAProgressWaits) {
  std::atomic<bool> inside{false};
  std::atomic<int> nested{0};
  std::promise<void> told;
  Client sut(options());
  const auto progress = [&, first = true](unsigned long long /*bytes*/) mutable {
    inside = true;
    if (std::exchange(first, false)) {
      sut.post("hosta", "line1/ready", [&](const Client::Outcome&) {
        nested += inside ? 1 : 0;
        told.set_value();
      });
    }
    while (event_.counted().count() == 0) (void)sut.start("hosta", "line1");
    (void)sut.start("hosta", "line1");  // the post has ended by now
    inside = false;
  };
  (void)sut.download_application("hosta", "line1", file_, {}, progress);
  told.get_future().wait();
  EXPECT_EQ(nested, 0);
}

TEST_F(ClientOrder, OfCallbacksIsOneAfterTheOtherAlsoWhenADownloadGoesOn) {
  std::atomic<bool> inside{false};
  std::atomic<int> nested{0};
  std::atomic<unsigned long long> received{0};
  std::promise<void> told;
  Client sut(options());
  sut.post("hosta", "line1/ready", [&](const Client::Outcome&) {
    inside = true;
    const auto progress = [&](unsigned long long bytes) {
      nested += inside ? 1 : 0;
      received = bytes;
    };
    sut.download_application("hosta", "line1", file_, {}, progress,
                             [&](const Client::Outcome&) { told.set_value(); });
    while (!has_come(ControlVerb::download_application)) (void)sut.start("hosta", "line1");
    inside = false;
  });
  told.get_future().wait();
  EXPECT_EQ(nested, 0);
  EXPECT_EQ(received, 100'000U) << "the last one is told before the end";
}

TEST_F(ClientOrder, TellsACallbackTheProgressOfItsOwnDownload) {
  std::promise<unsigned long long> told;
  Client sut(options());
  sut.post("hosta", "line1/ready", [&](const Client::Outcome&) {
    unsigned long long received = 0;
    (void)sut.download_application("hosta", "line1", file_, {},
                                   [&](unsigned long long bytes) { received = bytes; });
    told.set_value(received);
  });
  EXPECT_EQ(told.get_future().get(), 100'000U);
}

TEST_F(ClientOrder, AnswersAThreadForWhichACallbackWaits) {
  std::jthread other;
  std::promise<bool> told;
  Client sut(options());
  sut.post("hosta", "line1/ready", [&](const Client::Outcome&) {
    std::atomic<bool> answered{false};
    other = std::jthread([&] {
      (void)sut.post("hosta", "line1/ready");
      answered = true;
    });
    for (const TimePoint end = soon(); !answered && MonotonicClock::now() < end;)
      (void)sut.start("hosta", "line1");
    told.set_value(answered);
  });
  EXPECT_TRUE(told.get_future().get());
}

TEST_F(ClientOrder, OfDownloadsThatWaitEndsWithTheClient) {
  constexpr std::size_t kMany = 1'000;  // however late the client ends, some wait
  std::vector<int> codes;
  std::ofstream(file_) << 'x';
  {
    Client sut(options());
    for (std::size_t i = 0; i < kMany; ++i) {
      sut.download_application("hosta", "line1", file_, {}, {},
                               [&](const Client::Outcome& outcome) { codes.push_back(outcome.code); });
    }
    while (!has_come(ControlVerb::download_application))
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ASSERT_EQ(codes.size(), kMany);
  EXPECT_EQ(codes.back(), ClientError::unavailable);
}

TEST_F(ClientOrder, LetsACallThatHasEndedBeginAnotherWhileAsManyAsMayBeAreUnderWay) {
  std::atomic<unsigned> refused{0};
  std::atomic<unsigned> told{0};
  {
    Client sut(options());
    std::promise<void> all_begun;
    const auto last = [&](const Client::Outcome& outcome) {
      refused += outcome.code == static_cast<int>(ErrorCode::full) ? 1 : 0;
      ++told;
    };
    const auto begin_last = [&](const Client::Outcome& outcome) {
      EXPECT_TRUE(outcome) << outcome.text;
      sut.post("hosta", "line1/ready", last);
    };
    sut.post("hosta", "line1/ready",
             [&, begun = all_begun.get_future().share()](const Client::Outcome& outcome) {
               begun.wait();
               begin_last(outcome);
             });
    for (unsigned i = 1; i < kMostCalls; ++i) sut.post("hosta", "line1/ready", begin_last);
    all_begun.set_value();
    while (told < kMostCalls) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(refused, 0U);
  EXPECT_EQ(event_.counted().count(), 2U * kMostCalls);
}

}  // namespace
}  // namespace plchost
