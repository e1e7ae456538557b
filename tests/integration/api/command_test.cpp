#include <algorithm>
#include <ctime>
#include <future>
#include <memory>
#include <thread>

#include <gmock/gmock.h>

#include "api/client/control_client.hpp"
#include "api/dds/samples.hpp"
#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"
#include "api/server/clients/session_table.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// One that asks for nothing: it only has a reader of answers.
struct IdleClient {
  explicit IdleClient(std::uint32_t domain)
      : participant(dds_create_participant(domain, nullptr, nullptr)),
        topic(dds::make_topic(participant.get(), dds::kReply).value()),
        own(dds::make_subscriber(participant.get(),
                                 dds::client_partition(dds::guid_of(participant.get()).hex(), dds::kAllHosts))
                .value()),
        reader(dds::make_reader(own.get(), topic.get(), dds::qos_of(dds::kReply)).value()) {}
  [[nodiscard]] bool is_served() const {
    dds_subscription_matched_status_t matched{};
    return dds_get_subscription_matched_status(reader.get(), &matched) == 0 && matched.current_count > 0;
  }

  dds::Entity participant;
  dds::Entity topic;
  dds::Entity own;
  dds::Entity reader;
};

class RemoteCommand : public testing::Test {
 protected:
  RemoteCommand() {
    host_.write_instance(0, "line1", InstanceState::running, 4711);
    host_.write_count(1);
  }

  OwnDomain domain_;
  TestHost host_{domain_, "hosta"};
};

TEST_F(RemoteCommand, ReachesTheManagerAndBringsItsAnswerBack) {
  host_.answer_with({0, ErrorCode::wrong_state, "line1 runs already"});
  host_.start_server();
  const auto sut = connect(domain_);

  const auto reply = sut->call({"hosta", plc_OPERATION_START, "line1", ""}, soon());

  ASSERT_TRUE(reply) << reply.error().describe();
  EXPECT_EQ(reply->code, ErrorCode::wrong_state);
  EXPECT_EQ(reply->text, "line1 runs already");
  ASSERT_EQ(host_.requests().size(), 1U);
  EXPECT_EQ(host_.requests()[0].verb, ControlVerb::start);
  EXPECT_EQ(host_.requests()[0].instance, "line1");
}

TEST_F(RemoteCommand, IsSeenInTheStatusOnceItIsAnswered) {
  host_.start_server();
  const auto sut = connect(domain_);
  ASSERT_TRUE(sut->host("hosta", soon()));
  ASSERT_EQ(sut->instances("hosta", soon()).value().at(0).state, 2U);

  const auto reply = sut->call({"hosta", plc_OPERATION_STOP, "line1", ""}, soon());

  ASSERT_TRUE(reply && reply->code == ErrorCode::ok);
  EXPECT_EQ(sut->instances("hosta", soon()).value().at(0).state, 3U);
}

TEST_F(RemoteCommand, ForAnInstanceWhoseStatusIsBeingWrittenIsDone) {
  host_.start_server();
  const auto sut = connect(domain_);
  ASSERT_TRUE(sut->host("hosta", soon()));
  host_.interrupt_instance(0);
  std::this_thread::sleep_for(milliseconds(100));  // the server looks at the page every 10 ms

  const auto reply = sut->call({"hosta", plc_OPERATION_START, "line1", ""}, soon());

  ASSERT_TRUE(reply) << reply.error().describe();
  EXPECT_EQ(reply->code, ErrorCode::ok) << reply->text;
  EXPECT_EQ(sut->instances("hosta", soon()).value().size(), 1U);
}

TEST_F(RemoteCommand, IsAnsweredOnceTheStatusOfItsInstanceIsWritten) {
  host_.start_server();
  const auto sut = connect(domain_);
  ASSERT_TRUE(sut->host("hosta", soon()));
  host_.interrupt_instance(0);
  const TimePoint asked = MonotonicClock::now();
  TimePoint written;
  std::jthread manager([&] {
    while (host_.requests().empty()) std::this_thread::sleep_for(milliseconds(1));
    std::this_thread::sleep_for(milliseconds(50));
    host_.write_instance(0, "line1", InstanceState::safe_mode, 4711);
    written = MonotonicClock::now();
  });

  const auto reply = sut->call({"hosta", plc_OPERATION_START, "line1", ""}, soon());

  ASSERT_TRUE(reply && reply->code == ErrorCode::ok);
  const auto state = sut->instances("hosta", soon()).value().at(0).state;
  manager.join();
  // On a loaded machine the status may come later than the server waits for it.
  constexpr auto kServerWaits = milliseconds(500);
  EXPECT_TRUE(state == 6U || written - asked >= kServerWaits) << state;
}

TEST_F(RemoteCommand, IsAnsweredToTheOneOfTwoClientsOfAParticipantThatAsked) {
  constexpr int kEach = 50;
  host_.write_instance(1, "line2", InstanceState::running, 4712);
  host_.write_count(2);
  host_.start_server();
  const auto first = connect(domain_);
  const auto second = ControlClient::connect(first->participant()).value();
  const auto ask = [](ControlClient& client, const std::string& instance) {
    for (int i = 0; i < kEach; ++i) {
      const auto good = client.call({"hosta", plc_OPERATION_START, instance, ""}, soon());
      ASSERT_TRUE(good) << good.error().describe();
      EXPECT_EQ(good->code, ErrorCode::ok);
      const auto bad = client.call({"hosta", plc_OPERATION_START, instance + "x", ""}, soon());
      ASSERT_TRUE(bad) << bad.error().describe();
      EXPECT_THAT(bad->text, testing::HasSubstr(instance + "x"));
    }
  };
  {
    const std::jthread one([&] { ask(*first, "line1"); });
    const std::jthread other([&] { ask(*second, "line2"); });
  }
  EXPECT_EQ(host_.requests().size(), 2U * kEach);
}

// Its readers have room for so many answers. Cyclone's receiving thread waits for a full reader.
TEST_F(RemoteCommand, IsAnsweredWhileAnotherClientOfTheParticipantTakesNothing) {
  host_.start_server();
  const auto idle = connect(domain_);
  const auto sut = ControlClient::connect(idle->participant()).value();
  ASSERT_TRUE(idle->call({"hosta", plc_OPERATION_START, "line1", ""}, soon()));
  constexpr int kRoom = dds::kReply.qos.depth * dds::kMaxServersPerMachine;
  for (int i = 0; i < kRoom + 50; ++i) {
    const auto reply = sut->call({"hosta", plc_OPERATION_START, "line1", ""}, soon());
    ASSERT_TRUE(reply) << i << ": " << reply.error().describe();
  }
  EXPECT_TRUE(idle->call({"hosta", plc_OPERATION_START, "line1", ""}, soon()));
}

TEST_F(RemoteCommand, ForAnUnknownInstanceIsRefusedByName) {
  host_.start_server();
  const auto reply = connect(domain_)->call({"hosta", plc_OPERATION_START, "line9", ""}, soon());
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->code, ErrorCode::not_found);
  EXPECT_THAT(reply->text, testing::AllOf(testing::HasSubstr("line9"), testing::HasSubstr("line1")));
  EXPECT_TRUE(host_.requests().empty());
}

TEST_F(RemoteCommand, WithAnUnknownOperationIsRefusedByNumber) {
  host_.start_server();
  const auto reply = connect(domain_)->call({"hosta", 99, "line1", ""}, soon());
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->code, ErrorCode::unsupported);
  EXPECT_THAT(reply->text, testing::HasSubstr("99"));
}

TEST_F(RemoteCommand, IsDoneOnceHoweverOftenItIsRepeated) {
  host_.hold = true;
  host_.start_server();
  const auto sut = connect(domain_);

  auto reply = std::async(std::launch::async,
                          [&] { return sut->call({"hosta", plc_OPERATION_STOP, "line1", ""}, soon()); });
  while (host_.requests().empty()) std::this_thread::sleep_for(milliseconds(1));
  std::this_thread::sleep_for(seconds(2));  // it is repeated meanwhile
  host_.hold = false;

  EXPECT_TRUE(reply.get());
  EXPECT_TRUE(sut->call({"hosta", plc_OPERATION_START, "line1", ""}, soon())) << "behind all repetitions";
  EXPECT_EQ(host_.requests().size(), 2U);
}

TEST_F(RemoteCommand, SleepsWhileItsAnswerIsWaitedFor) {
  host_.silent = true;
  host_.start_server();
  const auto sut = connect(domain_);
  ASSERT_TRUE(sut->host("hosta", soon()));
  const auto used = [] {
    timespec time{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
  };

  const auto before = used();
  const TimePoint start = MonotonicClock::now();
  EXPECT_FALSE(sut->call({"hosta", plc_OPERATION_RESET, "line1", ""}, start + seconds(1)));
  EXPECT_LT(used() - before, (MonotonicClock::now() - start) / 4) << "the host's status keeps it awake";
}

TEST_F(RemoteCommand, OfAKilledClientDisturbsNoOther) {
  host_.silent = true;
  host_.start_server();
  {
    const Child killed(PLCCTL_PROGRAM, {"--domain", std::to_string(domain_.number()), "--timeout", "60",
                                        "stop", "instance", "line1"});
    while (host_.requests().empty()) std::this_thread::sleep_for(milliseconds(5));
  }
  host_.silent = false;

  const auto reply = connect(domain_)->call({"hosta", plc_OPERATION_START, "line1", ""}, soon());

  ASSERT_TRUE(reply) << reply.error().describe();
  EXPECT_EQ(reply->code, ErrorCode::ok);
}

TEST_F(RemoteCommand, OfAnotherClientIsAnsweredWhileOneIsStopped) {
  host_.start_server();
  const Child stopped(PLCCTL_PROGRAM, {"--domain", std::to_string(domain_.number()), "watch", "tasks"},
                      "/dev/null");
  std::this_thread::sleep_for(milliseconds(500));
  stopped.signal(SIGSTOP);
  const auto sut = connect(domain_);

  for (int i = 0; i < 200; ++i) {
    const auto reply = sut->call({"hosta", plc_OPERATION_STOP, "line1", ""}, soon());
    ASSERT_TRUE(reply) << i << ": " << reply.error().describe();
  }

  EXPECT_EQ(host_.requests().size(), 200U);
}

TEST_F(RemoteCommand, WorksForTwentyClientsAtOnce) {
  host_.start_server();
  std::vector<Child> clients;
  for (int i = 0; i < 20; ++i) {
    clients.emplace_back(PLCCTL_PROGRAM,
                         std::vector<std::string>{"--domain", std::to_string(domain_.number()), "--timeout",
                                                  "60", "stop", "instance", "line1"});
  }
  for (Child& client : clients) EXPECT_EQ(client.wait(), 0);
  EXPECT_EQ(host_.requests().size(), 20U);
}

// Longer away than DDS waits for a participant: to the server it has gone, and it does not know.
TEST_F(RemoteCommand, OfAClientThatWasOutOfReachMeanwhileIsDoneOnce) {
  host_.start_server();
  host_.hold = true;
  Child client(PLCCTL_PROGRAM, {"--domain", std::to_string(domain_.number()), "--timeout", "30", "stop",
                                "instance", "line1"});
  while (host_.requests().empty()) std::this_thread::sleep_for(milliseconds(1));
  client.signal(SIGSTOP);
  std::this_thread::sleep_for(seconds(5));
  host_.hold = false;
  std::this_thread::sleep_for(seconds(1));  // it is answered while nobody is there
  client.signal(SIGCONT);

  EXPECT_EQ(client.wait(), 0);
  EXPECT_EQ(host_.requests().size(), 1U);
}

TEST_F(RemoteCommand, OfOneMoreThanAreServedIsAnsweredInPlaceOfOneThatIsIdle) {
  host_.start_server();
  const auto client = connect(domain_);
  ASSERT_TRUE(client->host("hosta", soon()));
  std::vector<std::unique_ptr<IdleClient>> idle;
  for (std::size_t i = 0; i < SessionTable::kMaxSessions; ++i)
    idle.push_back(std::make_unique<IdleClient>(domain_.number()));
  const auto served = [&] {
    return std::ranges::count_if(idle, [](const auto& one) { return one->is_served(); });
  };
  constexpr Duration kMany = 3 * kPatience;  // as many participants as there are take long beside other tests
  for (const TimePoint end = MonotonicClock::now() + kMany;
       served() + 1 < std::ssize(idle) && MonotonicClock::now() < end;)
    std::this_thread::sleep_for(milliseconds(10));

  const auto late = connect(domain_);
  const auto reply = late->call({"hosta", plc_OPERATION_STOP, "line1", ""},
                                MonotonicClock::now() + kMany + SessionTable::kIdle);

  EXPECT_TRUE(reply) << reply.error().describe();
  EXPECT_EQ(host_.requests().size(), 1U) << "it was repeated, and done once";
}

TEST_F(RemoteCommand, WithAnotherWritersIdentityIsRefused) {
  host_.start_server();
  const auto client = connect(domain_);
  ASSERT_TRUE(client->host("hosta", soon()));
  const dds::Entity participant(dds_create_participant(domain_.number(), nullptr, nullptr));
  const auto topic = dds::make_topic(participant.get(), dds::kOperatorRequest).value();
  const auto publisher = dds::make_publisher(participant.get(), dds::host_partition("hosta")).value();
  const auto writer =
      dds::make_writer(publisher.get(), topic.get(), dds::qos_of(dds::kOperatorRequest)).value();
  const auto reply_topic = dds::make_topic(participant.get(), dds::kReply).value();
  const auto subscriber =
      dds::make_subscriber(participant.get(),
                           dds::client_partition(dds::guid_of(participant.get()).hex(), dds::kAllHosts))
          .value();
  const auto reader = dds::make_reader(subscriber.get(), reply_topic.get(), dds::qos_of(dds::kReply)).value();
  plc_Request request{};
  request.header.request_identity.writer_guid[0] = 0x55;
  dds::copy_text(request.header.instance_name, "hosta");
  dds::copy_text(request.instance, "line1");
  request.operation = plc_OPERATION_STOP;

  std::string text;
  while (text.empty()) {
    ASSERT_EQ(dds_write(writer.get(), &request), DDS_RETCODE_OK);
    std::this_thread::sleep_for(milliseconds(50));
    const dds::Samples<plc_Reply> replies(reader.get());
    if (replies.size() > 0 && replies.valid(0)) text = dds::text_of(replies[0].text);
  }

  EXPECT_THAT(text, testing::HasSubstr("identity"));
  EXPECT_TRUE(host_.requests().empty());
}

TEST_F(RemoteCommand, EndsTheServerWhenTheManagerIsGone) {
  host_.start_server();
  ASSERT_TRUE(connect(domain_)->host("hosta", soon()));
  host_.close_peer = true;
  EXPECT_EQ(host_.server().wait(), 0);
}

}  // namespace
}  // namespace plchost
