#include "api/dds/domain.hpp"

#include <algorithm>
#include <charconv>
#include <condition_variable>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string_view>
#include <system_error>

#include <dds/ddsrt/log.h>
#include <fmt/format.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include "api/dds/client_gate.hpp"
#include "api/dds/cyclone_version.h"
#include "api/dds/datagram_filter.h"
#include "api/dds/error.hpp"
#include "api/dds/handshakes.h"
#include "api/dds/security_section.hpp"
#include "api/dds/signed_messages.h"
#include "api/dds/steady_waits.hpp"
#include "api/dds/token_heap.hpp"
#include "api/security/identity.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/pages/host_words.hpp"
#include "shm/threads/thread.hpp"

namespace plchost::dds {

namespace {

// Interface names and addresses come from a command line and go into XML.
Result<void> check_address(std::string_view what, std::string_view text) {
  constexpr std::size_t kMaxAddress = 64;
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == ':' || c == '-' || c == '_' || c == '[' || c == ']' || c == '%' || c == '@';
  };
  if (!text.empty() && text.size() <= kMaxAddress && std::ranges::all_of(text, allowed)) return {};
  return failure(ErrorCode::invalid_argument, fmt::format("{} '{}' is not valid", what, text.substr(0, 100)));
}

// Whether the device says so; Cyclone warns of one that has none, in vain for a configuration that names
// addresses.
bool has_multicast(const std::string& interface) {
  const UniqueFd socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  ifreq request{};
  interface.copy(request.ifr_name, sizeof request.ifr_name - 1);
  return ::ioctl(socket.get(), SIOCGIFFLAGS, &request) != 0 || (request.ifr_flags & IFF_MULTICAST) != 0;
}

std::string threads_section(int fifo) {
  // Small stacks: with locked memory each thread would otherwise cost 8 MB.
  constexpr std::string_view kThread = "<Thread Name=\"{}\">{}<StackSize>512 kB</StackSize></Thread>";
  const std::string realtime =
      fifo > 0 ? fmt::format("<Scheduling><Class>Realtime</Class><Priority>{}</Priority></Scheduling>", fifo)
               : "";
  std::string section = "<Threads>";
  for (const std::string_view name : {"recv", "dq.user", "tev"})
    section += fmt::format(kThread, name, realtime);
  for (const std::string_view name : {"dq.builtins", "gc", "lease", "fsm"})
    section += fmt::format(kThread, name, "");
  return section + "</Threads>";
}

struct OpenDomain {
  std::weak_ptr<Entity> users;
  bool is_there = false;  // also when its last user is gone, until Cyclone has ended it
};

// The DDS domains of this process.
struct Registry {
  std::mutex mutex;
  std::condition_variable ended;
  std::map<std::uint32_t, OpenDomain> domains;
  std::set<std::uint32_t> gated;  // those of secured clients. A host has a gate of its own
};

// Never destroyed: a client may be a static object, which outlives the others.
Registry& registry() {
  static auto* const all = new Registry;  // NOLINT(cppcoreguidelines-owning-memory)
  return *all;
}

// Cyclone refuses to make a domain that it is still ending.
void end_domain(std::uint32_t number, std::unique_ptr<Entity> domain) {
  Registry& all = registry();
  const std::lock_guard lock(all.mutex);
  domain.reset();
  all.domains[number].is_there = false;
  all.ended.notify_all();
}

// With another release of Cyclone the client works all the same, and its log says what it lacks.
Result<void> filter_datagrams(const Entity& participant, std::string_view what) {
  if (plc_filter_datagrams(participant.get(), pass_to_client)) return {};
  const char* const why = plc_unknown_cyclone();
  if (why == nullptr) {
    return failure(ErrorCode::refused,
                   fmt::format("{}: the packets that it would receive cannot be filtered", what));
  }
  dds_log(DDS_LC_WARNING, __FILE__, __LINE__, __func__,
          "%s: packets of strangers are not filtered in this secured client\n", why);
  return {};
}

}  // namespace

Result<std::string> domain_configuration(Role role, const DomainOptions& options) {
  if (options.domain > kMaxDdsDomain) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("domain {} is not valid: allowed are 0 to {}", options.domain, kMaxDdsDomain));
  }
  std::string interfaces;
  bool loopback = false;
  bool multicast = false;
  for (const std::string& name : options.interfaces) {
    PLCHOST_TRY(check_address("interface", name));
    const bool by_multicast =
        options.multicast && name != "lo" && (options.peers.empty() || has_multicast(name));
    interfaces += fmt::format("<NetworkInterface name=\"{}\" multicast=\"{}\"/>", name,
                              by_multicast ? "default" : "false");
    loopback |= name == "lo";
    multicast |= by_multicast;
  }
  std::vector<std::string> addresses = options.peers;
  if (addresses.empty() && loopback) addresses.emplace_back("127.0.0.1");
  std::string peers;
  for (const std::string& address : addresses) {
    PLCHOST_TRY(check_address("peer", address));
    peers += fmt::format("<Peer Address=\"{}\"/>", address);
  }
  if (!peers.empty()) peers = fmt::format("<Peers>{}</Peers>", peers);
  PLCHOST_TRY_ASSIGN(const auto security, security_section(options.identity));
  // High at servers, because all writers of theirs are bounded by their own history or window: none may be
  // stopped because one client does not read. A client's is as much as it may have under way, some 500 posts.
  // That is far less than the server's sockets hold, so several clients that post as fast as they can lose
  // nothing and hold up nobody.
  const std::string_view watermark = role == Role::server ? "32 MB" : "128 kB";
  // A client's writer keeps what a killed server has not confirmed until that one's lease ends, or until its
  // successor shows its presence (plc_forget_participant()). One that posts fast is full within 0.1 s and
  // blocks until then. A secured host keeps the longer lease. When its process stands still and its clients
  // drop it, the host still knows them, and both need some 5 s to meet again.
  const std::string_view lease = role == Role::server && options.identity.empty() ? "500 ms" : "3 s";
  // Without multicast the announcement of a new server reaches no client, because clients have no known port.
  // The server finds each client by the client's next announcement.
  const std::string_view announcement = role == Role::server || multicast ? "1 s" : "200 ms";
  // One kept sample keeps the whole receive buffer that it came in. 256 KiB is twice Cyclone's smallest
  // buffer, and a quarter of its default.
  constexpr std::string_view kSizing = "<Sizing><ReceiveBufferSize>256 KiB</ReceiveBufferSize></Sizing>";
  return fmt::format(
      "<CycloneDDS><Domain "
      "Id=\"any\"><General><Interfaces>{}</Interfaces><AllowMulticast>{}</AllowMulticast>"
      "</General><Discovery><ParticipantIndex>{}</ParticipantIndex>"
      "<MaxAutoParticipantIndex>{}</MaxAutoParticipantIndex>{}<SPDPInterval>{}</SPDPInterval>"
      "<LeaseDuration>{}</LeaseDuration></Discovery><Internal>"
      "<MultipleReceiveThreads>false</MultipleReceiveThreads><NackDelay>1 ms</NackDelay><AckDelay>1 "
      "ms</AckDelay>"
      "<PreEmptiveAckDelay>1 ms</PreEmptiveAckDelay>"
      "<HeartbeatInterval min=\"1 ms\" minsched=\"5 ms\" max=\"1 s\">10 ms</HeartbeatInterval>"
      "<SocketReceiveBufferSize min=\"128 KiB\" max=\"4 MiB\"/><MaxSampleSize>256 KiB</MaxSampleSize>"
      "<Watermarks><WhcHigh>{}</WhcHigh><WhcHighInit>{}</WhcHighInit><WhcAdaptive>false</WhcAdaptive>"
      "</Watermarks></Internal>{}{}{}</Domain></CycloneDDS>",
      interfaces, multicast ? "spdp" : "false", role == Role::server ? "auto" : "none",
      kMaxServersPerMachine - 1, peers, announcement, lease, watermark, watermark, kSizing,
      threads_section(options.receive_fifo), security);
}

bool can_use_fifo(int priority) {
  auto thread = Thread::start("fifo-probe", {.fifo = priority}, [] {});
  return thread.has_value();
}

Result<std::shared_ptr<Entity>> open_domain(Role role, const DomainOptions& options) {
  wait_by_steady_clock();
  keep_tokens_once();
  PLCHOST_TRY_ASSIGN(const auto configuration, domain_configuration(role, options));
  Registry& all = registry();
  std::unique_lock lock(all.mutex);
  OpenDomain& opened = all.domains[options.domain];
  while (opened.is_there) {
    if (auto known = opened.users.lock()) return known;
    all.ended.wait(lock);
  }
  if (!options.identity.empty()) {
    // Cyclone would say why in its log only.
    PLCHOST_TRY(in_step("identity", security::check_identity(options.identity)));
  }
  PLCHOST_TRY_ASSIGN(auto made,
                     check_entity(dds_create_domain(options.domain, configuration.c_str()),
                                  fmt::format("cannot create DDS domain {} on interface {}", options.domain,
                                              fmt::join(options.interfaces, ", "))));
  std::shared_ptr<Entity> domain(
      new Entity(std::move(made)),  // NOLINT(cppcoreguidelines-owning-memory): for a deleter of its own
      [number = options.domain](Entity* ended) { end_domain(number, std::unique_ptr<Entity>(ended)); });
  opened = {.users = domain, .is_there = true};
  all.gated.erase(options.domain);
  if (role == Role::client && !options.identity.empty()) all.gated.insert(options.domain);
  return domain;
}

Result<Entity> make_participant(std::uint32_t domain, const dds_qos_t* qos, std::string_view what) {
  const std::lock_guard lock(registry().mutex);
  auto made = check_entity(dds_create_participant(domain, qos, nullptr), std::string(what));
  if (made) {
    (void)plc_watch_handshakes(made->get());
    (void)plc_decode_signed_once(made->get());
  }
  if (!made || !registry().gated.contains(domain)) return made;
  PLCHOST_TRY(filter_datagrams(*made, what));
  return made;
}

Result<int> tie_sockets_to_loopback() {
  int tied = 0;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", error)) {
    const std::string name = entry.path().filename();
    int fd = -1;
    std::from_chars(name.data(), name.data() + name.size(), fd);
    int type = 0;
    int family = 0;
    socklen_t size = sizeof type;
    if (::getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_DGRAM) continue;
    size = sizeof family;
    if (::getsockopt(fd, SOL_SOCKET, SO_DOMAIN, &family, &size) != 0) continue;
    if (family != AF_INET && family != AF_INET6) continue;
    constexpr std::string_view kLoopback = "lo";
    if (::setsockopt(fd, SOL_SOCKET, SO_BINDTODEVICE, kLoopback.data(), kLoopback.size()) != 0) {
      return failure(ErrorCode::system, "cannot tie a UDP socket to lo", errno);
    }
    ++tied;
  }
  if (error) return failure(ErrorCode::system, "cannot read /proc/self/fd", error.value());
  return tied;
}

}  // namespace plchost::dds
