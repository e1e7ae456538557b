// The end of the API server of the connection on which it asks an instance for values.
#include "api/server/lists/value_link.hpp"

#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "shm/sockets/packet_socket.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {
namespace {

/// The instance at the other end sends these replies, and closes the connection.
class ValueLinkTest : public testing::Test {
 protected:
  ValueLinkTest() { std::filesystem::create_directory(folder_); }
  ~ValueLinkTest() override { std::filesystem::remove_all(folder_); }
  ValueLink link_that_is_told(const ValueReply& reply) {
    auto listener = PacketListener::listen(values_socket_path(folder_, "line1")).value();
    auto link = ValueLink::connect(folder_, "line1").value();
    auto peer = *listener.accept().value();
    for (const std::string& packet : encode(reply)) EXPECT_TRUE(peer.send(packet));
    return link;
  }

  const std::string folder_ = own_path("values");
};

TEST_F(ValueLinkTest, GivesTheRepliesThatCameBeforeItsEnd) {
  ValueLink sut = link_that_is_told({.number = 7});
  const auto replies = sut.receive();
  ASSERT_TRUE(replies) << replies.error().describe();
  ASSERT_EQ(replies->size(), 1U);
  EXPECT_EQ(replies->front().number, 7U);
  EXPECT_EQ(sut.receive().error().code, ErrorCode::unavailable);
}

TEST_F(ValueLinkTest, TellsThatOthersHaveAllConnections) {
  ValueLink sut = link_that_is_told({.number = 0, .code = ErrorCode::busy});
  const auto replies = sut.receive();
  ASSERT_FALSE(replies);
  EXPECT_EQ(replies.error().code, ErrorCode::busy);
  EXPECT_EQ(replies.error().message, "other programs have all connections to its values");
}

}  // namespace
}  // namespace plchost
