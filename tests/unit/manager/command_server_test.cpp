#include "manager/control/command_server.hpp"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "shm/files/memory_rights.hpp"
#include "tests/support/can_enter.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

using testing::HasSubstr;

/// Keeps what it is asked for, and answers when the test says so.
class SlowHandler : public ControlHandler {
 public:
  void handle(const ControlRequest& request, ControlReplyFunction reply) override {
    asked.push_back(request);
    replies.push_back(std::move(reply));
  }
  std::vector<ControlRequest> asked;
  std::vector<ControlReplyFunction> replies;
};

class CommandServerTest : public testing::Test {
 protected:
  CommandServerTest() {
    path_ = own_path("commands").string();
    reactor_ = std::move(*Reactor::create());
    sut_ = std::move(*CommandServer::open(*reactor_, path_, handler_));
  }
  PacketSocket connect() { return std::move(*PacketSocket::connect(path_)); }
  /// Lets the server do what there is to do.
  void serve() {
    constexpr int kRounds = 20;  // all of it is there: it needs rounds, and no time
    for (int i = 0; i < kRounds; ++i) {
      Reactor::Timer end(*reactor_, [this] { reactor_->stop(); });
      end.set(TimePoint{});
      ASSERT_TRUE(reactor_->run());
    }
  }
  static std::string request(std::uint64_t number) {
    return encode(
        ControlRequest{.number = number, .verb = ControlVerb::stop, .instance = "a", .argument = ""});
  }
  static ControlReply reply_on(PacketSocket& socket) {
    auto packet = socket.receive();
    if (!packet || !*packet) return {.number = 0, .code = ErrorCode::unavailable, .text = "no reply"};
    return *decode_reply(**packet);
  }
  static bool is_closed(PacketSocket& socket) {
    for (;;) {
      const auto packet = socket.receive();
      if (!packet) return true;
      if (!*packet) return false;
    }
  }

  std::string path_;
  SlowHandler handler_;
  std::unique_ptr<Reactor> reactor_;
  std::unique_ptr<CommandServer> sut_;
};

TEST_F(CommandServerTest, BringsRequestsInAndRepliesBackInAnyOrder) {
  auto client = connect();
  ASSERT_TRUE(client.send(request(1)));
  ASSERT_TRUE(client.send(request(2)));
  serve();
  ASSERT_EQ(handler_.asked.size(), 2U);
  handler_.replies[1]({.number = 2, .code = ErrorCode::busy, .text = "x"});
  handler_.replies[0]({.number = 1, .code = ErrorCode::ok, .text = ""});
  EXPECT_EQ(reply_on(client).number, 2U);
  EXPECT_EQ(reply_on(client).number, 1U);
}

// They have the manager's group, which the socket is for.
TEST_F(CommandServerTest, ServesNoUserOfInstances) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root has instances of another user";
  constexpr uid_t kUser = 64043;
  constexpr uid_t kOther = 64044;
  const auto folder = std::filesystem::path(path_).parent_path();
  ASSERT_TRUE(can_enter(folder, kUser)) << "other users may not enter " << folder << ", or a folder above it";
  ASSERT_TRUE(trust_instances_of(kUser));
  const auto connect_as = [this](uid_t user) {
    (void)::syscall(SYS_setresuid, -1, user, -1);
    auto client = PacketSocket::connect(path_);
    (void)::syscall(SYS_setresuid, -1, 0, -1);
    return client;
  };
  std::filesystem::permissions(path_, std::filesystem::perms(0666));
  auto instance = connect_as(kUser);
  auto other = connect_as(kOther);
  ASSERT_TRUE(instance && other);
  (void)instance->send(request(1));
  (void)other->send(request(2));
  serve();
  EXPECT_TRUE(is_closed(*instance));
  ASSERT_EQ(handler_.asked.size(), 1U);
  EXPECT_EQ(handler_.asked[0].number, 2U);
}

TEST_F(CommandServerTest, AnswersGarbageAndClosesAfterTooMuchOfIt) {
  auto client = connect();
  auto other = connect();
  ASSERT_TRUE(client.send("{\"version\": 99, \"number\": 1}"));
  serve();
  const auto reply = reply_on(client);
  EXPECT_EQ(reply.number, 0U);
  EXPECT_EQ(reply.code, ErrorCode::corrupt);
  EXPECT_THAT(reply.text, HasSubstr("version 99; expected is version 2"));
  for (int i = 0; i < kMaxBadPackets; ++i) ASSERT_TRUE(client.send("\xff\xfe garbage"));
  serve();
  EXPECT_TRUE(is_closed(client));
  EXPECT_FALSE(is_closed(other));
  EXPECT_TRUE(handler_.asked.empty());
}

// It waited in the socket while the manager stood still.
TEST_F(CommandServerTest, DoesNotHandleWhatCameAfterItsTimeLimit) {
  auto client = connect();
  const ControlRequest request{.number = 5,
                               .verb = ControlVerb::start,
                               .instance = "a",
                               .argument = "",
                               .limit_ns = boot_time_ns() + Duration(std::chrono::milliseconds(20)).count()};
  ASSERT_TRUE(client.send(encode(request)));
  ::usleep(30'000);
  serve();
  const auto reply = reply_on(client);
  EXPECT_EQ(reply.number, 5U);
  EXPECT_EQ(reply.code, ErrorCode::timed_out);
  EXPECT_THAT(reply.text, HasSubstr("not done"));
  EXPECT_TRUE(handler_.asked.empty());
}

// A client whose server has ended repeats its request by way of the next one.
TEST_F(CommandServerTest, DoesARepeatedRequestOnceAndAnswersAllThatAsk) {
  const auto repeated = [](std::uint64_t number, const std::string& id) {
    return encode(ControlRequest{
        .number = number, .verb = ControlVerb::restart, .instance = "a", .argument = "", .id = id});
  };
  auto first = std::make_unique<PacketSocket>(connect());
  ASSERT_TRUE(first->send(repeated(7, "client.1")));
  serve();
  first.reset();
  auto next = connect();
  ASSERT_TRUE(next.send(repeated(1, "client.1")));
  ASSERT_TRUE(next.send(repeated(2, "client.2")));
  serve();
  ASSERT_EQ(handler_.asked.size(), 2U);
  EXPECT_TRUE(sut_->waits_for_answers());
  handler_.replies[0]({.number = 7, .code = ErrorCode::timed_out, .text = "said"});
  const ControlReply told = reply_on(next);
  EXPECT_EQ(told.number, 1U);
  EXPECT_EQ(told.code, ErrorCode::timed_out);
  EXPECT_EQ(told.text, "said");
  auto last = connect();
  ASSERT_TRUE(last.send(repeated(4, "client.1")));
  serve();
  EXPECT_EQ(handler_.asked.size(), 2U);
  const ControlReply again = reply_on(last);
  EXPECT_EQ(again.number, 4U);
  EXPECT_EQ(again.text, "said");
  handler_.replies[1]({.number = 2, .code = ErrorCode::ok, .text = ""});
  EXPECT_EQ(reply_on(next).number, 2U);
  EXPECT_FALSE(sut_->waits_for_answers());
}

TEST_F(CommandServerTest, DropsTheReplyOfAPeerThatHasGone) {
  {
    auto client = connect();
    ASSERT_TRUE(client.send(request(1)));
    serve();
  }
  serve();
  handler_.replies.at(0)({.number = 1, .code = ErrorCode::ok, .text = ""});
}

TEST_F(CommandServerTest, BoundsTheRequestsOfOnePeer) {
  auto client = connect();
  for (std::size_t i = 0; i <= kMaxPendingRequests; ++i) {
    ASSERT_TRUE(client.send(request(i + 1)));
    serve();
  }
  EXPECT_EQ(handler_.asked.size(), kMaxPendingRequests);
  const auto reply = reply_on(client);
  EXPECT_EQ(reply.number, kMaxPendingRequests + 1);
  EXPECT_EQ(reply.code, ErrorCode::busy);
  EXPECT_THAT(reply.text, HasSubstr("64 requests of this peer"));
}

TEST_F(CommandServerTest, ClosesAPeerThatDoesNotReadAndServesTheOthers) {
  auto deaf = connect();
  auto other = connect();
  ASSERT_TRUE(deaf.send(request(1)));
  serve();
  ASSERT_EQ(handler_.replies.size(), 1U);
  // Replies beyond what the kernel holds and what the server keeps.
  const ControlReply large{.number = 1, .code = ErrorCode::ok, .text = std::string(4000, 'x')};
  for (std::size_t i = 0; i < 2 * kMaxUnreadReplies + 1000; ++i) handler_.replies[0](large);
  EXPECT_TRUE(is_closed(deaf));
  ASSERT_TRUE(other.send(request(5)));
  serve();
  EXPECT_EQ(handler_.asked.back().number, 5U);
}

TEST_F(CommandServerTest, RefusesMorePeersThanItHasRoomFor) {
  std::vector<PacketSocket> clients;
  for (std::size_t i = 0; i < kMaxConnections; ++i) {
    clients.push_back(connect());
    serve();
  }
  auto sut = connect();
  serve();
  const auto reply = reply_on(sut);
  EXPECT_EQ(reply.code, ErrorCode::busy);
  EXPECT_THAT(reply.text, HasSubstr("16 peers are connected already"));
  clients.pop_back();
  serve();
  auto next = connect();
  ASSERT_TRUE(next.send(request(9)));
  serve();
  EXPECT_EQ(handler_.asked.back().number, 9U);
}

}  // namespace
}  // namespace plchost
