// The order of the calls of a client, and of its callbacks.
#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "tests/integration/api/client_library.hpp"

namespace plchost {
namespace {

class ClientOrder : public ClientLibrary {
 protected:
  ClientOrder() { host_.answer_with({0, ErrorCode::ok, "done"}); }
  [[nodiscard]] std::vector<std::string> arguments() {
    std::vector<std::string> all;
    for (const ControlRequest& request : host_.requests()) all.push_back(request.argument);
    return all;
  }
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

}  // namespace
}  // namespace plchost
