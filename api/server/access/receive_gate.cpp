#include "api/server/access/receive_gate.hpp"

#include <atomic>
#include <mutex>

#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "api/dds/gate/handshake_assembly.hpp"
#include "api/dds/gate/packet_gate.hpp"

namespace plchost {

namespace {

enum class Gate : std::uint8_t { open, unsecured, secured };

std::atomic<Gate> gate{Gate::open};
std::atomic<std::uint64_t> refused{0};

bool is_of_network(const msghdr& message) noexcept {
  if (message.msg_name == nullptr || message.msg_namelen < sizeof(sa_family_t)) return false;
  const auto family = static_cast<const sockaddr*>(message.msg_name)->sa_family;
  return family == AF_INET || family == AF_INET6;
}

// What DDS gets instead of a datagram; 0: nothing.
std::size_t let_pass(std::span<std::byte> buffer, std::size_t size, bool secured) {
  if (!dds::is_acceptable(buffer.first(size), secured)) {
    refused.fetch_add(1, std::memory_order_relaxed);
    return 0;
  }
  if (!secured) return size;
  // DDS receives with one thread, but does not promise it.
  static std::mutex mutex;
  static dds::HandshakeAssembly assembly;
  const std::lock_guard lock(mutex);
  return assembly.rewrite(buffer, size);
}

}  // namespace

void close_receive_gate(bool secured) noexcept {
  gate.store(secured ? Gate::secured : Gate::unsecured, std::memory_order_relaxed);
}

std::uint64_t datagrams_refused() noexcept {
  return refused.load(std::memory_order_relaxed);
}

}  // namespace plchost

// A program's own function goes before that of the C library, also for the libraries that it uses: DDS reads
// all datagrams by this one.
extern "C" __attribute__((visibility("default"))) ssize_t recvmsg(int socket, msghdr* message, int flags) {
  const ssize_t got = ::syscall(SYS_recvmsg, socket, message, flags);
  const auto gate = plchost::gate.load(std::memory_order_relaxed);
  // DDS gives one buffer, large enough for every datagram.
  if (got <= 0 || gate == plchost::Gate::open || message->msg_iovlen != 1 ||
      !plchost::is_of_network(*message)) {
    return got;
  }
  const auto size = static_cast<std::size_t>(got);
  if (size > message->msg_iov->iov_len) return got;
  constexpr ssize_t kDropped = 1;
  const std::span buffer(static_cast<std::byte*>(message->msg_iov->iov_base), message->msg_iov->iov_len);
  const std::size_t passed = plchost::let_pass(buffer, size, gate == plchost::Gate::secured);
  return passed == 0 ? kDropped : static_cast<ssize_t>(passed);
}
