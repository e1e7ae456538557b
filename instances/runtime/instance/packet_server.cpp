#include "instances/runtime/instance/packet_server.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include <sys/epoll.h>
#include <sys/resource.h>

#include "shm/base/system_call.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

Result<void> watch(const UniqueFd& epoll, int fd, std::uint32_t events = EPOLLIN) {
  epoll_event event{.events = events, .data = {.fd = fd}};
  PLCHOST_TRY(check_errno(::epoll_ctl(epoll.get(), EPOLL_CTL_ADD, fd, &event),
                          "cannot watch a socket of the instance"));
  return {};
}

// The application gets fewer descriptors than the system allows the process: the rest is for connections.
void reserve_descriptors() {
  constexpr rlim_t kReserve = PacketServer::kMostOfAll;
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_max < 4 * kReserve) return;
  limit.rlim_cur = std::min(limit.rlim_cur, limit.rlim_max - kReserve);
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

// While one of these is there, the reserve can be used.
class MoreDescriptors {
 public:
  MoreDescriptors() {
    known_ = ::getrlimit(RLIMIT_NOFILE, &before_) == 0;
    const rlimit more{.rlim_cur = before_.rlim_max, .rlim_max = before_.rlim_max};
    known_ = known_ && ::setrlimit(RLIMIT_NOFILE, &more) == 0;
  }
  ~MoreDescriptors() {
    if (known_) ::setrlimit(RLIMIT_NOFILE, &before_);
  }
  MoreDescriptors(const MoreDescriptors&) = delete;
  MoreDescriptors& operator=(const MoreDescriptors&) = delete;

 private:
  rlimit before_{};
  bool known_ = false;
};

}  // namespace

Result<PacketServer> PacketServer::listen(Options options) {
  PLCHOST_TRY_ASSIGN(auto listener, PacketListener::listen(options.path));
  reserve_descriptors();
  UniqueFd epoll(::epoll_create1(EPOLL_CLOEXEC));
  if (!epoll) return failure(ErrorCode::system, "cannot create an epoll descriptor", errno);
  // Told once for each new connection: one that cannot be taken must not keep the control thread awake.
  PLCHOST_TRY(watch(epoll, listener.fd(), EPOLLIN | EPOLLET));
  return PacketServer(std::move(listener), std::move(epoll), std::move(options));
}

Result<std::optional<PacketSocket>> PacketServer::accept() {
  auto accepted = listener_.accept();
  if (accepted || accepted.error().system_errno != EMFILE) return accepted;
  const MoreDescriptors more;
  return listener_.accept();
}

void PacketServer::beat() {
  if (waiting_) accept_all();
}

void PacketServer::accept_all() {
  waiting_ = true;
  for (std::size_t i = 0; i <= options_.most; ++i) {
    auto accepted = accept();
    if (accepted && !*accepted) waiting_ = false;
    if (!accepted || !*accepted) return;
    PacketSocket connection = *std::move(*accepted);
    if (connections_.size() == options_.most) {
      (void)connection.send(options_.full);
      continue;
    }
    const int fd = connection.fd();
    if (watch(epoll_, fd)) connections_.emplace(fd, Connection{next_id_++, std::move(connection)});
  }
}

bool PacketServer::send(std::uint64_t connection, std::span<const std::string> packets) {
  const auto found =
      std::ranges::find_if(connections_, [&](const auto& entry) { return entry.second.id == connection; });
  if (found == connections_.end()) return false;
  const bool serving = serving_ == connection;
  if (serving && serving_over_) return false;
  const bool sent = std::ranges::all_of(
      packets, [&](const std::string& packet) { return found->second.socket.send(packet).has_value(); });
  if (sent) return true;
  spdlog::warn("a connection of {} was closed: its client does not read its replies", options_.path);
  if (serving) {
    serving_over_ = true;  // serve() uses it, and closes it
  } else {
    connections_.erase(found);
  }
  return false;
}

bool PacketServer::serve_one(Connection& connection, const Take& take) {
  auto packet = connection.socket.receive();
  if (packet && !*packet) return true;
  if (!packet && packet.error().code != ErrorCode::corrupt) return false;  // the peer is gone
  const bool goes_on = packet ? take(connection.id, *std::move(*packet))
                              : take(connection.id, std::unexpected(std::move(packet).error()));
  return goes_on && !serving_over_;
}

void PacketServer::serve(const Take& take) {
  std::array<epoll_event, kMostOfAll + 1> events{};
  const int count = ::epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), 0);
  for (int i = 0; i < count; ++i) {
    const int fd = events.at(static_cast<std::size_t>(i)).data.fd;
    const bool hung_up = (events.at(static_cast<std::size_t>(i)).events & EPOLLHUP) != 0;
    if (fd == listener_.fd()) {
      accept_all();
    } else if (const auto found = connections_.find(fd); found != connections_.end()) {
      serving_ = found->second.id;
      serving_over_ = false;
      if (hung_up || !serve_one(found->second, take)) connections_.erase(found);
      serving_ = 0;
    }
  }
}

}  // namespace plchost
