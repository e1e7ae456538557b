// Messages in plain text to a secured client: those of its host that are lost, and those of a stranger.
#include <chrono>
#include <string>
#include <thread>

#include <gmock/gmock.h>

#include "tests/integration/security/secured_host.hpp"
#include "tests/integration/security/wire.hpp"

namespace plchost {
namespace {

class PlainText : public SecuredHost {
 protected:
  [[nodiscard]] static testing::AssertionResult can_post(ControlClient& client, Duration patience) {
    const auto posted = client.post_event({"cell", "line1", "ready"}, 1, {}, patience);
    if (posted) return testing::AssertionSuccess();
    return testing::AssertionFailure() << posted.error().describe();
  }
};

// Fast DDS loses it whenever it comes behind messages for others, any client if a socket is full.
TEST_F(PlainText, TheLastMessageOfAHandshakeIsRepeatedUntilItHasCome) {
  start();
  Wire wire;
  wire.lose_last_messages(2);
  const auto client = make_client();
  EXPECT_TRUE(can_post(*client, kPatience));
  EXPECT_GE(wire.last_messages(), 3);
}

// That a participant has ended, as if its writer of secured announcements said so. The sender names itself:
// of the participant's own writers Cyclone knows that they speak encrypted.
std::string disposal_of(const std::string& participant) {
  using std::string_literals::operator""s;
  return "RTPS\x02\x01\x01\x10"s
         "any stranger"s
         "\x15\x0b\x3c\x00"s                                  // a sample, with inline QoS and a key
         "\x00\x00\x10\x00\x00\x00\x00\x00\xff\x01\x01\xc2"s  // to all, by a writer of that kind
         "\x00\x00\x00\x00\x02\x00\x00\x00"s                  // its number
         "\x71\x00\x04\x00\x00\x00\x00\x03\x01\x00\x00\x00"s  // disposed and unregistered
         "\x00\x03\x00\x00\x50\x00\x10\x00"s +
         participant +  // by its GUID prefix
         "\x00\x00\x01\xc1\x01\x00\x00\x00"s;
}

// Cyclone alone believes it: it checks nowhere who sends such a message.
TEST_F(PlainText, AStrangerCannotEndAHostForItsClients) {
  start();
  Wire wire;
  const auto client = make_client();
  ASSERT_TRUE(can_post(*client, kPatience));
  const std::string disposal = disposal_of(wire.host());
  for (int round = 0; round < 5; ++round) {
    send_to(own_udp_ports(), disposal);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  EXPECT_TRUE(can_post(*client, std::chrono::seconds(5)));
}

}  // namespace
}  // namespace plchost
