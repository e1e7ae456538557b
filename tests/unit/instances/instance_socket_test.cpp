#include "instances/runtime/instance/instance_socket.hpp"

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

namespace plchost {
namespace {

class InstanceSocketTest : public testing::Test {
 protected:
  InstanceSocketTest() : directory_(std::filesystem::temp_directory_path() / "plchost-is-XXXXXX") {
    std::string made = directory_;
    if (::mkdtemp(made.data()) != nullptr) directory_ = made;
  }
  ~InstanceSocketTest() override { std::filesystem::remove_all(directory_); }

  void listen() {
    auto made = InstanceSocket::listen(
        directory_ / "s", [this](const ControlRequest& asked, const InstanceSocket::Asker& asker) {
          return handler_(asked, asker);
        });
    ASSERT_TRUE(made) << made.error().describe();
    sut_ = std::make_unique<InstanceSocket>(*std::move(made));
  }
  [[nodiscard]] PacketSocket connect() {
    auto connected = PacketSocket::connect(directory_ / "s");
    EXPECT_TRUE(connected);
    return *std::move(connected);
  }

  static std::string request(std::uint64_t number, std::string argument = {}) {
    return encode(ControlRequest{
        .number = number, .verb = ControlVerb::status, .instance = "i", .argument = std::move(argument)});
  }
  static ControlReply reply(std::string text) {
    return {.number = 0, .code = ErrorCode::ok, .text = std::move(text)};
  }

  std::filesystem::path directory_;
  InstanceSocket::Handler handler_;
  std::unique_ptr<InstanceSocket> sut_;
};

TEST_F(InstanceSocketTest, AnswersAtOnceOrLater) {
  InstanceSocket::Asker later;
  handler_ = [&](const ControlRequest& asked,
                 const InstanceSocket::Asker& asker) -> std::optional<ControlReply> {
    if (asked.argument == "now") return reply("at once");
    later = asker;
    return std::nullopt;
  };
  listen();
  PacketSocket client = connect();
  ASSERT_TRUE(client.send(request(1, "later")));
  ASSERT_TRUE(client.send(request(2, "now")));
  for (int i = 0; i < 3; ++i) sut_->serve();
  EXPECT_EQ(decode_reply(client.receive().value().value())->number, 2U);
  sut_->answer(later, reply("later"));
  EXPECT_EQ(decode_reply(client.receive().value().value())->number, 1U);
}

TEST_F(InstanceSocketTest, CarriesOutNoRequestWhoseClientHasGone) {
  int carried_out = 0;
  handler_ = [&](const ControlRequest&, const InstanceSocket::Asker&) -> std::optional<ControlReply> {
    ++carried_out;
    return reply("done");
  };
  listen();
  {
    PacketSocket client = connect();
    ASSERT_TRUE(client.send(request(1)));
    sut_->serve();  // takes the connection
    ASSERT_TRUE(client.send(request(2)));
  }
  for (int i = 0; i < 3; ++i) sut_->serve();
  EXPECT_EQ(carried_out, 0);
}

// While a request of a connection is worked on, another one of it is answered, and cannot be, because its
// client reads nothing. A descriptor that is opened then must not get what was meant for that client.
TEST_F(InstanceSocketTest, ConnectionThatFailsWhileItsRequestIsWorkedOnIsClosedAfterwards) {
  std::array<int, 2> opened{-1, -1};
  handler_ = [&](const ControlRequest& /*request*/,
                 const InstanceSocket::Asker& asker) -> std::optional<ControlReply> {
    const std::string text(8000, 'x');
    for (int i = 0; i < 60; ++i) sut_->answer(asker, reply(text));
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, opened.data()), 0);
    return reply("of the request");
  };
  listen();
  PacketSocket client = connect();
  ASSERT_TRUE(client.send(request(1)));
  for (int i = 0; i < 3; ++i) sut_->serve();
  for (const int fd : opened) {
    ASSERT_GE(fd, 0);
    std::array<char, 64> packet{};
    EXPECT_EQ(::recv(fd, packet.data(), packet.size(), 0), -1) << "got what was meant for another one";
  }
  for (const int fd : opened) ::close(fd);
  // The data sent before it failed is there, then its end.
  auto received = client.receive();
  while (received && *received) received = client.receive();
  ASSERT_FALSE(received);
  EXPECT_EQ(received.error().code, ErrorCode::unavailable);
  // Others are served.
  handler_ = [](const ControlRequest&, const InstanceSocket::Asker&) { return reply("good"); };
  PacketSocket other = connect();
  ASSERT_TRUE(other.send(request(5)));
  for (int i = 0; i < 3; ++i) sut_->serve();
  EXPECT_EQ(decode_reply(other.receive().value().value())->text, "good");
}

}  // namespace
}  // namespace plchost
