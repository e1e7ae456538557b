// A secured client and its host that lose each other at different times: one drops the other, which still
// hears announcements. They must meet again.
#include <chrono>
#include <limits>
#include <string>
#include <thread>

#include <gmock/gmock.h>

#include "tests/integration/security/secured_host.hpp"
#include "tests/integration/security/wire.hpp"

namespace plchost {
namespace {

// Longer than the lease of either side.
constexpr auto kLeaseEnds = std::chrono::milliseconds(4500);
// They need two leases and two seconds, a loaded machine more.
constexpr auto kMeetAgain = std::chrono::seconds(60);

class LostContact : public SecuredHost {
 protected:
  /// A client whose handshake waits for its last message.
  [[nodiscard]] std::unique_ptr<ControlClient> make_client_without_last_message() {
    wire_.lose_last_messages(std::numeric_limits<int>::max());
    auto client = make_client();
    EXPECT_TRUE(wire_.await_last_message(kPatience));
    return client;
  }

  Wire wire_;
};

TEST_F(LostContact, AClientThatHasDroppedItsHostMeetsItAgain) {
  start();
  const auto client = make_client();
  ASSERT_TRUE(can_post(*client, kPatience));
  Wire::make_deaf(kLeaseEnds);
  EXPECT_TRUE(can_post(*client, kMeetAgain));
  EXPECT_GE(wire_.last_messages(), 2) << "the client has not dropped its host";
}

TEST_F(LostContact, AClientThatItsHostHasDroppedMeetsItAgain) {
  start();
  const auto client = make_client();
  ASSERT_TRUE(can_post(*client, kPatience));
  Wire::make_mute(kLeaseEnds);
  EXPECT_TRUE(can_post(*client, kMeetAgain));
  EXPECT_GE(wire_.last_messages(), 2) << "the host has not dropped its client";
}

TEST_F(LostContact, AClientThatDropsItsHostWithinTheHandshakeMeetsItAgain) {
  start();
  const auto client = make_client_without_last_message();
  Wire::make_deaf(kLeaseEnds);
  wire_.lose_last_messages(0);
  EXPECT_TRUE(can_post(*client, kMeetAgain));
}

TEST_F(LostContact, AClientThatItsHostDropsWithinTheHandshakeMeetsItAgain) {
  start();
  const auto client = make_client_without_last_message();
  Wire::make_mute(kLeaseEnds);
  wire_.lose_last_messages(0);
  EXPECT_TRUE(can_post(*client, kMeetAgain));
}

TEST_F(LostContact, BothThatDropEachOtherOneAfterTheOtherMeetAgain) {
  start();
  const auto client = make_client_without_last_message();
  Wire::make_mute(kLeaseEnds);
  Wire::make_deaf(kLeaseEnds);
  wire_.lose_last_messages(0);
  EXPECT_TRUE(can_post(*client, kMeetAgain));
}

// A request for authentication with another challenge, as the sender would send it that begins anew.
std::string with_other_challenge(std::string datagram) {
  constexpr std::string_view kName("future_challenge\0", 17);
  const std::size_t name = datagram.find(kName);
  if (name == std::string::npos) return {};
  const std::size_t value = (name + kName.size() + 3) / 4 * 4 + sizeof(std::uint32_t);
  datagram.at(value) = static_cast<char>(datagram.at(value) ^ 1);
  return datagram;
}

// A message as the other side of the two would send it.
std::string turned_round(std::string datagram, const std::string& one, const std::string& other) {
  if (one.empty() || one.size() != other.size()) return {};
  for (std::size_t at = 0; at + one.size() <= datagram.size(); ++at) {
    const bool is_one = datagram.compare(at, one.size(), one) == 0;
    if (!is_one && datagram.compare(at, other.size(), other) != 0) continue;
    datagram.replace(at, one.size(), is_one ? other : one);
    at += one.size() - 1;
  }
  return datagram;
}

// The messages by which a stranger says that the client, and the host, begin anew.
struct Forged {
  std::string to_host;
  std::string to_client;
};

Forged forge(const Wire& wire) {
  const Wire::Requests seen = wire.requests();
  const auto turned = [&](const std::string& request) {
    return turned_round(request, wire.client(), wire.host());
  };
  return {.to_host = with_other_challenge(seen.sent.empty() ? turned(seen.received) : seen.sent),
          .to_client = with_other_challenge(seen.received.empty() ? turned(seen.sent) : seen.received)};
}

// Such a message is in plain text, so anybody can send it. Protected messages renew the leases beside it.
TEST_F(LostContact, AStrangerWhoSaysThatOneBeginsAnewSeparatesNobody) {
  start();
  const auto client = make_client();
  ASSERT_TRUE(can_post(*client, kPatience));
  const Forged anew = forge(wire_);
  ASSERT_FALSE(anew.to_host.empty());
  ASSERT_FALSE(anew.to_client.empty());
  const int handshakes = wire_.last_messages();
  for (const auto end = MonotonicClock::now() + kLeaseEnds; MonotonicClock::now() < end;) {
    send_to({wire_.host_port()}, anew.to_host);
    send_to(own_udp_ports(), anew.to_client);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  EXPECT_TRUE(can_post(*client, kPatience));
  EXPECT_EQ(wire_.last_messages(), handshakes);
}

TEST_F(LostContact, AStrangerWhoSaysSoWithinTheHandshakeDoesNotKeepThemApart) {
  start();
  const auto client = make_client_without_last_message();
  const Forged anew = forge(wire_);
  ASSERT_FALSE(anew.to_client.empty());
  const auto ports = own_udp_ports();
  send_to(ports, anew.to_client);
  const std::jthread stranger([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      send_to(ports, anew.to_client);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
  wire_.lose_last_messages(0);
  EXPECT_TRUE(can_post(*client, kMeetAgain));
}

}  // namespace
}  // namespace plchost
