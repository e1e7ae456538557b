#include "tests/integration/security/wire.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <mutex>
#include <span>
#include <string_view>
#include <thread>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "api/dds/gate/submessage.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

struct State {
  std::mutex mutex;
  bool is_watched = false;
  int lost = 0;
  int last_messages = 0;
  std::string has_keys;  ///< empty: all have
  int lost_keys = 0;
  int sent = 0;
  TimePoint deaf_until{};
  TimePoint mute_until{};
  std::string host;
  std::uint16_t host_port = 0;
  std::string client;
  Wire::Requests requests;
};

State& state() {
  static State state;
  return state;
}

constexpr std::string_view kRequest("+AuthReq\0", 9);
constexpr std::string_view kHandshake("DDS:Auth:PKI-DH:1.0+");
constexpr std::string_view kLastMessage("PKI-DH:1.0+Final");

bool has(std::string_view datagram, std::string_view text) {
  return datagram.find(text) != std::string_view::npos;
}

// Keys come in messages of one participant's own, which are encrypted and not signed as a whole.
bool tells_keys(std::string_view datagram, std::string_view but) {
  using namespace dds::submessage_kind;
  constexpr std::size_t kDestinationSize = dds::kSubmessageHeader + dds::kGuidPrefix;
  bool is_for_other = false;
  const auto bytes = std::as_bytes(std::span(datagram));
  for (auto rest = bytes.subspan(dds::kRtpsHeader); !rest.empty();) {
    const auto submessage = dds::first_submessage(rest);
    if (!submessage || submessage->kind() == kSecuredMessagePrefix) return false;
    const std::size_t at = bytes.size() - rest.size();
    if (submessage->kind() == kInfoDestination && submessage->bytes.size() >= kDestinationSize) {
      is_for_other = datagram.substr(at + dds::kSubmessageHeader, dds::kGuidPrefix) != but;
    }
    if (submessage->kind() == kSecuredPrefix && is_for_other) return true;
    rest = rest.subspan(submessage->bytes.size());
  }
  return false;
}

// Whether the datagram is dropped.
bool is_lost_coming(std::string_view datagram) {
  State& wire = state();
  const std::lock_guard lock(wire.mutex);
  if (!wire.is_watched) return false;
  if (MonotonicClock::now() < wire.deaf_until) return true;
  if (!wire.has_keys.empty() && tells_keys(datagram, wire.has_keys)) {
    ++wire.lost_keys;
    return true;
  }
  if (has(datagram, kRequest)) wire.requests.received = datagram;
  if (!has(datagram, kLastMessage)) return false;
  ++wire.last_messages;
  wire.host = datagram.substr(dds::kGuidPrefixAt, dds::kGuidPrefix);
  if (wire.lost == 0) return false;
  --wire.lost;
  return true;
}

bool is_lost_going(std::string_view datagram, std::uint16_t port) {
  State& wire = state();
  const std::lock_guard lock(wire.mutex);
  if (!wire.is_watched) return false;
  ++wire.sent;
  if (MonotonicClock::now() < wire.mute_until) return true;
  if (has(datagram, kHandshake)) {
    wire.host_port = port;
    wire.client = datagram.substr(dds::kGuidPrefixAt, dds::kGuidPrefix);
  }
  if (has(datagram, kRequest)) wire.requests.sent = datagram;
  return false;
}

std::string joined(const msghdr& message) {
  std::string datagram;
  for (std::size_t i = 0; i < message.msg_iovlen; ++i) {
    const iovec& part = message.msg_iov[i];
    datagram.append(static_cast<const char*>(part.iov_base), part.iov_len);
  }
  return datagram;
}

}  // namespace

Wire::Wire() {
  State& wire = state();
  const std::lock_guard lock(wire.mutex);
  wire.is_watched = true;
  wire.lost = 0;
  wire.last_messages = 0;
  wire.has_keys.clear();
  wire.lost_keys = 0;
  wire.sent = 0;
  wire.deaf_until = {};
  wire.mute_until = {};
  wire.host.clear();
  wire.host_port = 0;
  wire.client.clear();
  wire.requests = {};
}

Wire::~Wire() {
  const std::lock_guard lock(state().mutex);
  state().is_watched = false;
}

void Wire::lose_last_messages(int count) {
  const std::lock_guard lock(state().mutex);
  state().lost = count;
}

int Wire::last_messages() const {
  const std::lock_guard lock(state().mutex);
  return state().last_messages;
}

bool Wire::await_last_message(Duration patience) const {
  const int before = last_messages();
  for (const auto end = MonotonicClock::now() + patience; MonotonicClock::now() < end;) {
    if (last_messages() > before) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

void Wire::lose_keys_but_of(const std::string& but) {
  const std::lock_guard lock(state().mutex);
  state().has_keys = but;
}

int Wire::sent() const {
  const std::lock_guard lock(state().mutex);
  return state().sent;
}

int Wire::lost_keys() const {
  const std::lock_guard lock(state().mutex);
  return state().lost_keys;
}

void Wire::make_deaf(Duration time) {
  {
    const std::lock_guard lock(state().mutex);
    state().deaf_until = MonotonicClock::now() + time;
  }
  std::this_thread::sleep_for(time);
}

void Wire::make_mute(Duration time) {
  {
    const std::lock_guard lock(state().mutex);
    state().mute_until = MonotonicClock::now() + time;
  }
  std::this_thread::sleep_for(time);
}

std::string Wire::host() const {
  const std::lock_guard lock(state().mutex);
  return state().host;
}

Wire::Requests Wire::requests() const {
  const std::lock_guard lock(state().mutex);
  return state().requests;
}

std::string Wire::client() const {
  const std::lock_guard lock(state().mutex);
  return state().client;
}

std::uint16_t Wire::host_port() const {
  const std::lock_guard lock(state().mutex);
  return state().host_port;
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

void send_to(const std::vector<std::uint16_t>& ports, const std::string& datagram) {
  ASSERT_FALSE(ports.empty());
  const UniqueFd stranger(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  for (const std::uint16_t port : ports) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(port);
    ASSERT_EQ(::sendto(stranger.get(), datagram.data(), datagram.size(), 0, reinterpret_cast<sockaddr*>(&to),
                       sizeof to),
              static_cast<ssize_t>(datagram.size()));
  }
}

}  // namespace plchost

// These two in front of the C library's, also for Cyclone.
extern "C" __attribute__((visibility("default"))) ssize_t recvmsg(int socket, msghdr* message, int flags) {
  const ssize_t got = ::syscall(SYS_recvmsg, socket, message, flags);
  if (got <= 0 || message->msg_iovlen != 1) return got;
  const std::size_t size = std::min(static_cast<std::size_t>(got), message->msg_iov->iov_len);
  constexpr ssize_t kDropped = 1;
  const std::string_view datagram(static_cast<const char*>(message->msg_iov->iov_base), size);
  return datagram.starts_with("RTPS") && plchost::is_lost_coming(datagram) ? kDropped : got;
}

extern "C" __attribute__((visibility("default"))) ssize_t sendmsg(int socket, const msghdr* message,
                                                                  int flags) {
  if (message->msg_name != nullptr && message->msg_namelen >= sizeof(sockaddr_in)) {
    const auto& to = *static_cast<const sockaddr_in*>(message->msg_name);
    const std::string datagram = plchost::joined(*message);
    if (to.sin_family == AF_INET && datagram.starts_with("RTPS") &&
        plchost::is_lost_going(datagram, ntohs(to.sin_port))) {
      return static_cast<ssize_t>(datagram.size());
    }
  }
  return ::syscall(SYS_sendmsg, socket, message, flags);
}
