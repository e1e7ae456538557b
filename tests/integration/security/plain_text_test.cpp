// Messages in plain text to a secured client: those of its host that are lost, and those of a stranger.
#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "api/dds/gate/submessage.hpp"
#include "shm/base/unique_fd.hpp"
#include "tests/integration/security/secured_host.hpp"

namespace plchost {
namespace {

using HostPrefix = std::array<char, dds::kGuidPrefix>;

// The last messages of handshakes, and the host that sends them.
struct LastMessages {
  std::mutex mutex;
  int lost = 0;   ///< so many that come from now on do not
  int count = 0;  ///< that have come to the socket
  HostPrefix from{};
};

LastMessages& last_messages() {
  static LastMessages messages;
  return messages;
}

// Whether the datagram is dropped.
bool is_lost(std::string_view datagram) {
  if (!datagram.starts_with("RTPS") || datagram.find("PKI-DH:1.0+Final") == std::string_view::npos)
    return false;
  LastMessages& messages = last_messages();
  const std::lock_guard lock(messages.mutex);
  ++messages.count;
  std::ranges::copy(datagram.substr(dds::kGuidPrefixAt, dds::kGuidPrefix), messages.from.begin());
  if (messages.lost == 0) return false;
  --messages.lost;
  return true;
}

class PlainText : public SecuredHost {
 protected:
  [[nodiscard]] static testing::AssertionResult can_post(ControlClient& client, Duration patience) {
    const auto posted = client.post_event({"cell", 0, "line1", "ready"}, 1, {}, patience);
    if (posted) return testing::AssertionSuccess();
    return testing::AssertionFailure() << posted.error().describe();
  }
};

// Fast DDS loses it whenever it comes behind messages for others, any client if a socket is full.
TEST_F(PlainText, TheLastMessageOfAHandshakeIsRepeatedUntilItHasCome) {
  start();
  {
    const std::lock_guard lock(last_messages().mutex);
    last_messages().lost = 2;
    last_messages().count = 0;
  }
  const auto client = make_client();
  EXPECT_TRUE(can_post(*client, kPatience));
  const std::lock_guard lock(last_messages().mutex);
  EXPECT_GE(last_messages().count, 3);
}

std::vector<std::uint16_t> own_udp_ports() {
  std::vector<std::uint16_t> ports;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const std::string name = entry.path().filename();
    int fd = -1;
    std::from_chars(name.data(), name.data() + name.size(), fd);
    int type = 0;
    socklen_t size = sizeof type;
    if (::getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_DGRAM) continue;
    sockaddr_in address{};
    size = sizeof address;
    if (::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) != 0) continue;
    if (address.sin_family == AF_INET && address.sin_port != 0) ports.push_back(ntohs(address.sin_port));
  }
  return ports;
}

// That a participant has ended, as if its writer of secured announcements said so. The sender names itself:
// of the participant's own writers Cyclone knows that they speak encrypted.
std::string disposal_of(const HostPrefix& participant) {
  using std::string_literals::operator""s;
  const std::string prefix(participant.begin(), participant.end());
  return "RTPS\x02\x01\x01\x10"s
         "any stranger"s
         "\x15\x0b\x3c\x00"s                                  // a sample, with inline QoS and a key
         "\x00\x00\x10\x00\x00\x00\x00\x00\xff\x01\x01\xc2"s  // to all, by a writer of that kind
         "\x00\x00\x00\x00\x02\x00\x00\x00"s                  // its number
         "\x71\x00\x04\x00\x00\x00\x00\x03\x01\x00\x00\x00"s  // disposed and unregistered
         "\x00\x03\x00\x00\x50\x00\x10\x00"s +
         prefix +  // the participant
         "\x00\x00\x01\xc1\x01\x00\x00\x00"s;
}

// Cyclone alone believes it: it checks nowhere who sends such a message.
TEST_F(PlainText, AStrangerCannotEndAHostForItsClients) {
  start();
  const auto client = make_client();
  ASSERT_TRUE(can_post(*client, kPatience));
  HostPrefix host{};
  {
    const std::lock_guard lock(last_messages().mutex);
    host = last_messages().from;
  }
  const std::string disposal = disposal_of(host);
  const UniqueFd stranger(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const auto ports = own_udp_ports();
  ASSERT_FALSE(ports.empty());
  for (int round = 0; round < 5; ++round) {
    for (const std::uint16_t port : ports) {
      sockaddr_in to{};
      to.sin_family = AF_INET;
      to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      to.sin_port = htons(port);
      ASSERT_EQ(::sendto(stranger.get(), disposal.data(), disposal.size(), 0,
                         reinterpret_cast<sockaddr*>(&to), sizeof to),
                static_cast<ssize_t>(disposal.size()));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  EXPECT_TRUE(can_post(*client, std::chrono::seconds(5)));
}

}  // namespace
}  // namespace plchost

// In front of the C library's, also for Cyclone.
extern "C" __attribute__((visibility("default"))) ssize_t recvmsg(int socket, msghdr* message, int flags) {
  const ssize_t got = ::syscall(SYS_recvmsg, socket, message, flags);
  if (got <= 0 || message->msg_iovlen != 1) return got;
  const std::size_t size = std::min(static_cast<std::size_t>(got), message->msg_iov->iov_len);
  constexpr ssize_t kDropped = 1;
  const std::string_view datagram(static_cast<const char*>(message->msg_iov->iov_base), size);
  return plchost::is_lost(datagram) ? kDropped : got;
}
