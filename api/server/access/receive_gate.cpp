#include "api/server/access/receive_gate.hpp"

#include <atomic>
#include <mutex>
#include <string>

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "api/dds/gate/handshake_assembly.hpp"
#include "api/dds/gate/packet_gate.hpp"
#include "api/dds/gate/renewal_gate.hpp"
#include "api/dds/gate/source_table.hpp"
#include "api/dds/handshake_record.hpp"
#include "shm/base/time.hpp"

namespace plchost {

namespace {

enum class Gate : std::uint8_t { open, unsecured, secured };

std::atomic<Gate> gate{Gate::open};
std::atomic<std::uint64_t> refused{0};

// Written before DDS has threads. Never destroyed: these may outlive it.
struct OwnHost {
  std::string name;
  bool sends_blocks = false;
};
OwnHost& own_host() {
  static auto* const own = new OwnHost;  // NOLINT(cppcoreguidelines-owning-memory)
  return *own;
}

bool is_of_network(const msghdr& message) noexcept {
  if (message.msg_name == nullptr || message.msg_namelen < sizeof(sa_family_t)) return false;
  const auto family = static_cast<const sockaddr*>(message.msg_name)->sa_family;
  return family == AF_INET || family == AF_INET6;
}

// The port of this machine that a datagram comes from. 0: it comes from another machine, which may have
// several addresses and send from each by a port of its own.
std::uint16_t port_on_this_machine(const msghdr& message) noexcept {
  if (message.msg_namelen < sizeof(sockaddr_in)) return 0;
  const auto& from = *static_cast<const sockaddr_in*>(message.msg_name);
  if (from.sin_family != AF_INET || from.sin_addr.s_addr != htonl(INADDR_LOOPBACK)) return 0;
  return ntohs(from.sin_port);
}

bool may_pass(std::span<std::byte> datagram, bool secured, const msghdr& message) noexcept {
  const dds::Admission admission = dds::admit(datagram, secured);
  if (admission == dds::Admission::refused) return false;
  if (admission == dds::Admission::cut) refused.fetch_add(1, std::memory_order_relaxed);
  const std::uint16_t port = secured ? std::uint16_t{0} : port_on_this_machine(message);
  if (port == 0) return true;
  static dds::SourceTable sources;
  return dds::every_sender(datagram, [port, now = MonotonicClock::now()](const auto guid_prefix) {
    return sources.is_its_own(guid_prefix, port, now);
  });
}

// The length that DDS gets of a datagram; 0: nothing.
std::size_t let_pass(std::span<std::byte> buffer, std::size_t size, bool secured, const msghdr& message) {
  // DDS receives with one thread, but does not promise it.
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  if (!may_pass(buffer.first(size), secured, message)) {
    refused.fetch_add(1, std::memory_order_relaxed);
    return 0;
  }
  if (secured) {
    static dds::HandshakeAssembly assembly;
    size = dds::take_out_doubted(buffer.first(assembly.rewrite(buffer, size)), dds::own_record());
  }
  const OwnHost& own = own_host();
  return dds::take_out_other_hosts(buffer.first(size), {.name = own.name, .sends_blocks = own.sends_blocks});
}

}  // namespace

void close_receive_gate(bool secured, const dds::HostMark& own) {
  own_host() = {.name = std::string(own.name), .sends_blocks = own.sends_blocks};
  gate.store(secured ? Gate::secured : Gate::unsecured, std::memory_order_release);
}

std::uint64_t datagrams_refused() noexcept {
  return refused.load(std::memory_order_relaxed);
}

}  // namespace plchost

// A program's own function goes before that of the C library, also for the libraries that it uses: DDS reads
// all datagrams by this one.
extern "C" __attribute__((visibility("default"))) ssize_t recvmsg(int socket, msghdr* message, int flags) {
  const ssize_t got = ::syscall(SYS_recvmsg, socket, message, flags);
  const auto gate = plchost::gate.load(std::memory_order_acquire);
  // DDS gives one buffer, large enough for every datagram.
  if (got <= 0 || gate == plchost::Gate::open || message->msg_iovlen != 1 ||
      !plchost::is_of_network(*message)) {
    return got;
  }
  const auto size = static_cast<std::size_t>(got);
  if (size > message->msg_iov->iov_len) return got;
  constexpr ssize_t kDropped = 1;
  const std::span buffer(static_cast<std::byte*>(message->msg_iov->iov_base), message->msg_iov->iov_len);
  const std::size_t passed = plchost::let_pass(buffer, size, gate == plchost::Gate::secured, *message);
  return passed == 0 ? kDropped : static_cast<ssize_t>(passed);
}
