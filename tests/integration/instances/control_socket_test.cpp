// The control socket of a real plc-instance.
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "instances/launch/launch_contract.hpp"
#include "tests/integration/instances/instance_process.hpp"
#include "tests/support/receive_until.hpp"

namespace plchost::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

class ControlSocket : public ::testing::Test {
 protected:
  Sandbox sandbox_;
  InstanceProcess sut_{sandbox_, {"--application", application("all_kinds")}};
  void SetUp() override { sut_.wait_until_up(); }

  static ControlReply reply(PacketSocket& socket) {
    const auto packet = receive_until(socket, MonotonicClock::now() + 20s);
    EXPECT_TRUE(packet);
    return packet ? decode_reply(*packet).value_or(ControlReply{}) : ControlReply{};
  }
};

TEST_F(ControlSocket, StopsAndStartsTheApplication) {
  EXPECT_EQ(sut_.ask(ControlVerb::stop).code, ErrorCode::ok);
  EXPECT_EQ(sut_.task("Fast")->state, PageTaskState::stopped);
  EXPECT_EQ(sut_.event("work").post(), PostResult::no_task);
  EXPECT_EQ(sut_.ask(ControlVerb::stop).code, ErrorCode::wrong_state);
  const auto cycles = sut_.task("Fast")->counters.cycles;
  EXPECT_EQ(sut_.ask(ControlVerb::start).code, ErrorCode::ok);
  EXPECT_EQ(sut_.ask(ControlVerb::start).code, ErrorCode::wrong_state);
  EXPECT_TRUE(eventually([&] { return sut_.task("Fast")->counters.cycles > cycles; }));
  EXPECT_EQ(sut_.task("Work")->counters.cycles, 0U);  // posts while it was stopped are not run
}

TEST_F(ControlSocket, DoesNotStartWhatCameWhileTheProcessStoodStillAndWasGivenUp) {
  ASSERT_EQ(sut_.ask(ControlVerb::stop).code, ErrorCode::ok);
  PacketSocket manager = sut_.connect();
  ::kill(sut_.pid(), SIGSTOP);
  ControlRequest request{.number = 9, .verb = ControlVerb::start, .instance = "line1", .argument = ""};
  request.limit_ns = boot_time_ns() + Duration(50ms).count();
  ASSERT_TRUE(manager.send(encode(request)));
  std::this_thread::sleep_for(100ms);
  ::kill(sut_.pid(), SIGCONT);
  const ControlReply late = reply(manager);
  EXPECT_EQ(late.number, 9U);
  EXPECT_EQ(late.code, ErrorCode::timed_out) << late.text;
  EXPECT_EQ(sut_.task("Fast")->state, PageTaskState::stopped);
  request.limit_ns = boot_time_ns() + Duration(1h).count();
  ASSERT_TRUE(manager.send(encode(request)));
  EXPECT_EQ(reply(manager).code, ErrorCode::ok);
}

TEST_F(ControlSocket, ServesNewConnectionsWhenTheApplicationHasUsedUpTheDescriptors) {
  rlimit used{};
  ASSERT_EQ(::prlimit(sut_.pid(), RLIMIT_NOFILE, nullptr, &used), 0);
  EXPECT_GE(used.rlim_max - used.rlim_cur, 16U);  // these are kept for connections
  used.rlim_cur = 0;                              // the lowest that is free
  while (std::filesystem::exists(
      std::filesystem::symlink_status(fmt::format("/proc/{}/fd/{}", sut_.pid(), used.rlim_cur)))) {
    ++used.rlim_cur;
  }
  ASSERT_EQ(::prlimit(sut_.pid(), RLIMIT_NOFILE, &used, nullptr), 0);
  EXPECT_EQ(sut_.ask(ControlVerb::status).code, ErrorCode::ok);
  EXPECT_EQ(sut_.ask(ControlVerb::stop).code, ErrorCode::ok);
  rlimit after{};
  ASSERT_EQ(::prlimit(sut_.pid(), RLIMIT_NOFILE, nullptr, &after), 0);
  EXPECT_EQ(after.rlim_cur, used.rlim_cur);  // the application gets none of it
}

TEST_F(ControlSocket, ResetsTheStatisticsOfOneTaskOrOfAllWhileTheyRun) {
  const auto recorded = [&](const char* task) { return sut_.task(task)->counters.recorded; };
  ASSERT_TRUE(eventually([&] { return recorded("Fast") > 200 && recorded("Loop") > 20; }));
  const TaskCounters before = sut_.task("Fast")->counters;
  const auto since_of_loop = sut_.task("Loop")->counters.since_ns;

  EXPECT_EQ(sut_.ask(ControlVerb::reset_statistics, "Fast").code, ErrorCode::ok);

  const TaskCounters after = sut_.task("Fast")->counters;
  EXPECT_GE(after.cycles, before.cycles) << "the cycle count goes on";
  EXPECT_GT(after.since_ns, before.since_ns);
  EXPECT_GE(after.cycles - after.recorded, before.recorded) << "earlier cycles are not counted any more";
  EXPECT_EQ(sut_.task("Loop")->counters.since_ns, since_of_loop);
  EXPECT_EQ(sut_.ask(ControlVerb::stop).code, ErrorCode::ok);
  EXPECT_EQ(sut_.ask(ControlVerb::reset_statistics).code, ErrorCode::ok) << "also of parked tasks";
  for (const char* task : {"Fast", "Loop"}) {
    EXPECT_EQ(recorded(task), 0U);
    EXPECT_GT(sut_.task(task)->counters.cycles, 0U);
  }
  const auto refused = sut_.ask(ControlVerb::reset_statistics, "Fst");
  EXPECT_EQ(refused.code, ErrorCode::not_found);
  EXPECT_THAT(refused.text, HasSubstr("Fast"));
}

TEST_F(ControlSocket, TellsItsStatus) {
  const auto report = decode_instance_report(sut_.ask(ControlVerb::status).text);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->pid, sut_.pid());
  EXPECT_EQ(report->state, std::to_underlying(ApplicationState::running));
  EXPECT_EQ(report->scheduler, "CmpSchedule");
  EXPECT_THAT(report->application, HasSubstr("all_kinds.so"));
}

TEST_F(ControlSocket, RefusesAnUnknownSchedulerAndListsWhatThereIs) {
  const auto refused = sut_.ask(ControlVerb::set_scheduler, "CmpShedule");
  EXPECT_EQ(refused.code, ErrorCode::invalid_argument);
  EXPECT_THAT(refused.text, HasSubstr("CmpScheduleOneShot"));
}

TEST_F(ControlSocket, BindsAnEventThatIsRegisteredLate) {
  EXPECT_EQ(sut_.event("late").post(), PostResult::not_registered);
  EXPECT_EQ(sut_.ask(ControlVerb::register_event, "late").code, ErrorCode::ok);
  EXPECT_EQ(sut_.event("late").post(), PostResult::posted);
  EXPECT_TRUE(eventually([&] { return sut_.task("Late")->counters.cycles == 1; }));
  EXPECT_EQ(sut_.ask(ControlVerb::unregister_event, "late").code, ErrorCode::ok);
  EXPECT_EQ(sut_.event("late").post(), PostResult::not_registered);
  const auto refused = sut_.ask(ControlVerb::unregister_event, "late");
  EXPECT_EQ(refused.code, ErrorCode::not_found);
  EXPECT_THAT(refused.text, HasSubstr("work"));  // lists what is registered
}

TEST_F(ControlSocket, RefusesABadEventName) {
  EXPECT_EQ(sut_.ask(ControlVerb::register_event, "not a name").code, ErrorCode::invalid_argument);
  EXPECT_EQ(sut_.ask(ControlVerb::register_event, "line2/other").code, ErrorCode::invalid_argument);
  EXPECT_EQ(sut_.ask(ControlVerb::register_event, std::string(51, 'x')).code, ErrorCode::invalid_argument);
}

TEST_F(ControlSocket, RegistrationByTheOperatorOutlivesTheProcess) {
  EXPECT_EQ(sut_.ask(ControlVerb::register_event, "late").code, ErrorCode::ok);
  EXPECT_EQ(sut_.end(SIGKILL), -SIGKILL);
  InstanceProcess next(sandbox_, {"--application", application("all_kinds")});
  next.wait_until_up();
  EXPECT_EQ(next.event("late").post(), PostResult::posted);
}

TEST_F(ControlSocket, SendsToTheManagerWhatNeedsAFreshProcess) {
  for (const ControlVerb verb :
       {ControlVerb::reset, ControlVerb::reset_cold, ControlVerb::restart, ControlVerb::load_application}) {
    EXPECT_EQ(sut_.ask(verb).code, ErrorCode::unsupported);
  }
}

TEST_F(ControlSocket, AnswersGarbageWithAReasonAndGoesOn) {
  PacketSocket socket = sut_.connect();
  const std::vector<std::string> garbage{"{", std::string(100, '\xff'), "[]", "{\"version\":9}",
                                         std::string(kMaxPacket, 'x')};
  for (const std::string& packet : garbage) {
    ASSERT_TRUE(socket.send(packet));
    const auto refused = reply(socket);
    EXPECT_EQ(refused.code, ErrorCode::corrupt);
    EXPECT_FALSE(refused.text.empty());
  }
  ASSERT_TRUE(socket.send(encode(ControlRequest{5, ControlVerb::status, "another", ""})));
  EXPECT_EQ(reply(socket).code, ErrorCode::not_found);
  ASSERT_TRUE(socket.send(encode(ControlRequest{6, ControlVerb::status, "line1", ""})));
  EXPECT_EQ(reply(socket).number, 6U);
}

TEST_F(ControlSocket, ClientThatNeverReadsBlocksNobody) {
  PacketSocket deaf = sut_.connect();
  for (int i = 0; i < 10'000; ++i) {
    if (const auto sent = deaf.send(encode(ControlRequest{1, ControlVerb::status, "line1", ""})); !sent)
      break;
  }
  EXPECT_EQ(sut_.ask(ControlVerb::status).code, ErrorCode::ok);
}

TEST_F(ControlSocket, TellsTheOneConnectionTooManyAndServesTheOthers) {
  std::vector<PacketSocket> connections;
  constexpr std::size_t kAllowed = 16;
  for (std::size_t i = 0; i < kAllowed; ++i) {
    connections.push_back(sut_.connect());
    ASSERT_TRUE(connections.back().send(encode(ControlRequest{i, ControlVerb::status, "line1", ""})));
    EXPECT_EQ(reply(connections.back()).code, ErrorCode::ok);
  }
  PacketSocket one_more = sut_.connect();
  EXPECT_EQ(reply(one_more).code, ErrorCode::busy);
  ASSERT_TRUE(connections.front().send(encode(ControlRequest{9, ControlVerb::status, "line1", ""})));
  EXPECT_EQ(reply(connections.front()).number, 9U);
}

TEST_F(ControlSocket, ShutsDownInOrder) {
  EXPECT_EQ(sut_.ask(ControlVerb::shutdown).code, ErrorCode::ok);
  EXPECT_EQ(sut_.end(), EXIT_SUCCESS);
  EXPECT_THAT(sut_.log(), HasSubstr("exit after"));
}

TEST(ControlSocketOfAnEmptyInstance, SaysThatThereIsNothingToStart) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {});
  sut.wait_until_up(false);
  const auto refused = sut.ask(ControlVerb::start);
  EXPECT_EQ(refused.code, ErrorCode::wrong_state);
  EXPECT_THAT(refused.text, HasSubstr("no application"));
}

TEST(ControlSocketOfAStoppedInstance, StartsIt) {
  const Sandbox sandbox;
  InstanceProcess sut(sandbox, {"--stopped", "--application", application("all_kinds")});
  sut.wait_until_up(false);
  EXPECT_EQ(sut.ask(ControlVerb::set_scheduler, "CmpScheduleTimer").code, ErrorCode::ok);
  EXPECT_EQ(sut.ask(ControlVerb::start).code, ErrorCode::ok);
  EXPECT_TRUE(eventually([&] { return sut.task("Fast")->counters.cycles > 10; }));
  EXPECT_EQ(decode_instance_report(sut.ask(ControlVerb::status).text)->scheduler, "CmpScheduleTimer");
}

}  // namespace
}  // namespace plchost::testing
