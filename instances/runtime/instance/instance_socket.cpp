#include "instances/runtime/instance/instance_socket.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <sys/epoll.h>
#include <sys/resource.h>

#include "shm/base/system_call.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

Result<void> watch(const UniqueFd& epoll, int fd, std::uint32_t events = EPOLLIN) {
  epoll_event event{.events = events, .data = {.fd = fd}};
  PLCHOST_TRY(
      check_errno(::epoll_ctl(epoll.get(), EPOLL_CTL_ADD, fd, &event), "cannot watch the control socket"));
  return {};
}

// The application gets fewer descriptors than the system allows the process: the rest is for connections.
void reserve_descriptors() {
  constexpr rlim_t kReserve = InstanceSocket::kMaxConnections;
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

Result<InstanceSocket> InstanceSocket::listen(const std::string& path, Handler handler) {
  PLCHOST_TRY_ASSIGN(auto listener, PacketListener::listen(path));
  reserve_descriptors();
  UniqueFd epoll(::epoll_create1(EPOLL_CLOEXEC));
  if (!epoll) return failure(ErrorCode::system, "cannot create an epoll descriptor", errno);
  // Told once for each new connection: one that cannot be taken must not keep the control thread awake.
  PLCHOST_TRY(watch(epoll, listener.fd(), EPOLLIN | EPOLLET));
  return InstanceSocket(std::move(listener), std::move(epoll), std::move(handler));
}

Result<std::optional<PacketSocket>> InstanceSocket::accept() {
  auto accepted = listener_.accept();
  if (accepted || accepted.error().system_errno != EMFILE) return accepted;
  const MoreDescriptors more;
  return listener_.accept();
}

void InstanceSocket::beat() {
  if (waiting_) accept_all();
}

void InstanceSocket::accept_all() {
  waiting_ = true;
  for (std::size_t i = 0; i <= kMaxConnections; ++i) {
    auto accepted = accept();
    if (accepted && !*accepted) waiting_ = false;
    if (!accepted || !*accepted) return;
    PacketSocket connection = *std::move(*accepted);
    if (connections_.size() == kMaxConnections) {
      (void)connection.send(
          encode(ControlReply{.number = 0,
                              .code = ErrorCode::busy,
                              .text = fmt::format("{} control connections are open, that is all there may be",
                                                  kMaxConnections)}));
      continue;
    }
    const int fd = connection.fd();
    if (watch(epoll_, fd)) connections_.emplace(fd, Connection{next_id_++, std::move(connection)});
  }
}

bool InstanceSocket::send(Connection& connection, const ControlReply& reply) {
  if (connection.socket.send(encode(reply))) return true;
  spdlog::warn("a control connection was closed: its client does not read its replies");
  return false;
}

void InstanceSocket::answer(const Asker& asker, ControlReply reply) {
  reply.number = asker.number;
  const auto found = std::ranges::find_if(
      connections_, [&](const auto& entry) { return entry.second.id == asker.connection; });
  if (found == connections_.end()) return;
  const bool serving = serving_ == found->second.id;
  if ((serving && serving_over_) || send(found->second, reply)) return;
  if (serving) {
    serving_over_ = true;  // serve() uses it, and closes it
  } else {
    connections_.erase(found);
  }
}

bool InstanceSocket::serve_one(Connection& connection) {
  auto packet = connection.socket.receive();
  if (packet && !*packet) return true;
  std::optional<Error> error;
  if (!packet) {
    if (packet.error().code != ErrorCode::corrupt) return false;  // the peer is gone
    error = packet.error();
  } else if (const auto request = decode_request(**packet)) {
    if (const auto in_time = check_in_time(request->limit_ns); !in_time) {
      return send(connection, ControlReply{.number = request->number,
                                           .code = in_time.error().code,
                                           .text = in_time.error().message});
    }
    auto reply = handler_(*request, Asker{.connection = connection.id, .number = request->number});
    if (serving_over_) return false;
    if (!reply) return true;
    reply->number = request->number;
    return send(connection, *reply);
  } else {
    error = request.error();
  }
  return send(connection, ControlReply{.number = 0, .code = error->code, .text = error->describe()});
}

void InstanceSocket::serve() {
  std::array<epoll_event, kMaxConnections + 1> events{};
  const int count = ::epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), 0);
  for (int i = 0; i < count; ++i) {
    const int fd = events.at(static_cast<std::size_t>(i)).data.fd;
    if (fd == listener_.fd()) {
      accept_all();
    } else if (const auto found = connections_.find(fd); found != connections_.end()) {
      serving_ = found->second.id;
      serving_over_ = false;
      if (!serve_one(found->second)) connections_.erase(found);
      serving_ = 0;
    }
  }
}

}  // namespace plchost
