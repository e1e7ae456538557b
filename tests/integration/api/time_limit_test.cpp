// A command whose failure was told is never done: a plchost-dds that stood still goes on with the requests
// that waited for it.
#include <csignal>
#include <fstream>
#include <thread>

#include <gmock/gmock.h>

#include "tests/integration/api/test_host.hpp"

namespace plchost {
namespace {

using std::chrono::milliseconds;
using testing::IsEmpty;
using testing::SizeIs;

constexpr Duration kGivesUp = milliseconds(800);
constexpr Duration kStandsStill = milliseconds(1300);

class StoppedServer : public testing::Test {
 protected:
  StoppedServer() {
    host_.write_instance(0, "line1", InstanceState::stopped, 4711);
    host_.write_count(1);
    event_ = host_.add_event("line1", "ready");
    event_.set_bound_tasks(1);
    host_.start_server();
  }

  /// A client that has spoken with the host.
  std::unique_ptr<ControlClient> known_client() {
    auto client = connect(domain_);
    EXPECT_TRUE(client->host("hosta", soon()));
    EXPECT_TRUE(client->prepare_posts("hosta", soon()));
    EXPECT_TRUE(client->call({"hosta", plc_OPERATION_READ_CLOCK, "", ""}, soon()));
    return client;
  }
  /// Until it stands still.
  void stop_server() {
    host_.server().signal(SIGSTOP);
    const std::string path = "/proc/" + std::to_string(host_.server().pid()) + "/stat";
    std::string stat;
    for (const TimePoint end = soon(); !stat.contains(") T ") && MonotonicClock::now() < end;)
      std::getline(std::ifstream(path), stat);
    std::this_thread::sleep_for(milliseconds(20));  // its other threads
  }
  /// Ends when the server has done whatever it is going to do.
  void go_on() {
    host_.server().signal(SIGCONT);
    const auto after = connect(domain_);
    ASSERT_TRUE(after->call({"hosta", plc_OPERATION_RESET, "line1", ""}, soon()));
  }
  /// The manager's requests, but for that.
  [[nodiscard]] std::vector<ControlVerb> done() {
    std::vector<ControlVerb> verbs;
    for (const ControlRequest& request : host_.requests()) {
      if (request.verb != ControlVerb::reset) verbs.push_back(request.verb);
    }
    return verbs;
  }

  OwnDomain domain_;
  TestHost host_{domain_, "hosta"};
  PoolEvent event_;
};

TEST_F(StoppedServer, DoesNotStartWhatItsClientHasGivenUp) {
  for (const bool ends : {true, false}) {
    auto client = known_client();
    stop_server();
    const TimePoint began = MonotonicClock::now();

    const auto reply = client->call({"hosta", plc_OPERATION_START, "line1", ""}, began + kGivesUp);

    ASSERT_FALSE(reply);
    EXPECT_EQ(reply.error().code, ErrorCode::timed_out);
    if (ends) client.reset();
    std::this_thread::sleep_until(
        std::chrono::steady_clock::time_point((began + kStandsStill).time_since_epoch()));
    go_on();
    EXPECT_THAT(done(), IsEmpty()) << (ends ? "its client has ended" : "its client is still there");
    if (client) {
      EXPECT_TRUE(client->call({"hosta", plc_OPERATION_RESET, "line1", ""}, soon())) << "it is heard again";
    }
  }
}

TEST_F(StoppedServer, DoesWhatItsClientStillWaitsForOnce) {
  const auto client = known_client();
  stop_server();
  std::jthread later([this] {
    std::this_thread::sleep_for(kStandsStill);
    host_.server().signal(SIGCONT);
  });
  const auto reply = client->call({"hosta", plc_OPERATION_START, "line1", ""}, soon());
  ASSERT_TRUE(reply) << reply.error().describe();
  EXPECT_EQ(reply->code, ErrorCode::ok) << reply->text;
  EXPECT_THAT(done(), SizeIs(1));
  EXPECT_GT(host_.requests().front().limit_ns, boot_time_ns()) << "the manager gets the limit, too";
}

TEST_F(StoppedServer, CountsNoPostThatItsClientHasGivenUp) {
  auto client = known_client();
  ASSERT_TRUE(client->post_event({"hosta", "line1", "ready"}, 3, {}, kPatience));
  stop_server();
  const TimePoint began = MonotonicClock::now();
  const auto report = client->post_event({"hosta", "line1", "ready"}, 5, {}, kGivesUp);
  ASSERT_TRUE(report) << report.error().describe();
  EXPECT_EQ(report->unacknowledged, 5U);
  const std::vector<EventId> batch{{"line1", "ready"}};
  EXPECT_FALSE(client->post_batch("hosta", batch, milliseconds(100)));
  client.reset();
  std::this_thread::sleep_until(
      std::chrono::steady_clock::time_point((began + kStandsStill).time_since_epoch()));
  go_on();
  EXPECT_EQ(event_.counted().count(), 3U);
}

TEST_F(StoppedServer, RejectsAGivenUpPostAndNotTheNextOne) {
  const auto client = known_client();
  const std::vector<EventId> batch{{"line1", "ready"}};
  ASSERT_TRUE(client->post_batch("hosta", batch, kPatience));
  stop_server();
  const TimePoint began = MonotonicClock::now();
  const auto report = client->post_event({"hosta", "line1", "ready"}, 1, {}, milliseconds(100));
  ASSERT_TRUE(report) << report.error().describe();
  EXPECT_EQ(report->unacknowledged, 1U);
  EXPECT_FALSE(client->post_batch("hosta", batch, milliseconds(100)));
  std::this_thread::sleep_until(
      std::chrono::steady_clock::time_point((began + kStandsStill).time_since_epoch()));
  go_on();

  const auto next = client->post_event({"hosta", "line1", "ready"}, 1, {}, kPatience);
  const auto next_batch = client->post_batch("hosta", batch, kPatience);

  ASSERT_TRUE(next && next_batch);
  EXPECT_EQ(next->rejected, 0U) << next->rejected_text;
  EXPECT_EQ(next->accepted, 1U);
  EXPECT_EQ(next_batch->rejected, 0U) << next_batch->rejected_text;
  EXPECT_EQ(next_batch->accepted, 1U);
  EXPECT_EQ(event_.counted().count(), 3U);
}

TEST_F(StoppedServer, RejectsAPostThatNobodyAwaitsAfterItsTimeAndCountsIt) {
  const auto client = known_client();
  ASSERT_TRUE(client->post_one("hosta", "line1", "ready"));
  while (event_.counted().count() < 1) std::this_thread::sleep_for(milliseconds(1));
  stop_server();
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(client->post_one("hosta", "line1", "ready", milliseconds(100)));
  std::this_thread::sleep_for(milliseconds(200));
  go_on();

  std::uint64_t later = 0;
  while (event_.counted().count() < 2) {  // again: a host that stood still for long is met anew
    ASSERT_TRUE(client->post_one("hosta", "line1", "ready", kPatience));
    ++later;
    std::this_thread::sleep_for(milliseconds(20));
  }
  plc_WriterStatus all{};
  for (const TimePoint end = soon(); all.delivered < 2 && MonotonicClock::now() < end;) {
    all = client->writers("hosta", end).value().front();
    if (all.delivered < 2) client->wait_for_change(end);
  }
  EXPECT_GE(all.rejected + all.lost, 3U);
  EXPECT_LE(event_.counted().count(), 1 + later);
}

TEST_F(StoppedServer, RejectsAPostThatNobodyAwaitsAfterTheTimeOfACommand) {
  const auto client = known_client();
  stop_server();
  ASSERT_TRUE(client->post_one("hosta", "line1", "ready"));
  std::this_thread::sleep_for(
      std::chrono::nanoseconds((kDefaultTimeout + Duration(milliseconds(100))).count()));
  go_on();
  EXPECT_EQ(event_.counted().count(), 0U);
}

TEST_F(StoppedServer, LoadsNothingThatItsClientHasGivenUp) {
  const auto client = known_client();
  const std::vector<std::byte> contents(3'000'000, std::byte{7});
  bool stopped = false;
  const auto stop = [&](std::uint64_t /*received*/) {
    if (!std::exchange(stopped, true)) host_.server().signal(SIGSTOP);
  };
  // 10 s after the last news it is given up.
  const auto reply = client->download(
      {.host = "hosta", .instance = "line1", .name = "other.so", .contents = contents}, stop, soon());
  ASSERT_FALSE(reply);
  go_on();
  EXPECT_THAT(done(), IsEmpty());
}

TEST_F(StoppedServer, AskedBeforeItWasReplacedDoesItOnceItIsThere) {
  const auto client = known_client();
  stop_server();
  std::jthread later([this] {
    std::this_thread::sleep_for(kStandsStill);
    host_.replace_server();
  });
  const auto reply = client->call({"hosta", plc_OPERATION_START, "line1", ""}, soon());
  ASSERT_TRUE(reply) << reply.error().describe();
  EXPECT_THAT(done(), SizeIs(1));
}

TEST_F(StoppedServer, TellsWhoGivesNoTimeLimit) {
  const auto client = known_client();
  const dds::Entity participant(dds_create_participant(domain_.number(), nullptr, nullptr));
  const auto topic = dds::make_topic(participant.get(), dds::kOperatorRequest).value();
  const auto publisher = dds::make_publisher(participant.get(), dds::host_partition("hosta")).value();
  const auto writer =
      dds::make_writer(publisher.get(), topic.get(), dds::qos_of(dds::kOperatorRequest)).value();
  plc_Request request{};
  dds::guid_of(writer.get()).copy_to(request.header.request_identity.writer_guid);
  request.header.request_identity.sequence_number = 1;
  dds::copy_text(request.header.instance_name, "hosta");
  dds::copy_text(request.instance, "line1");
  request.operation = plc_OPERATION_START;
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(dds_write(writer.get(), &request), DDS_RETCODE_OK);
    std::this_thread::sleep_for(milliseconds(10));
  }
  go_on();
  EXPECT_THAT(done(), IsEmpty());
}

}  // namespace
}  // namespace plchost
