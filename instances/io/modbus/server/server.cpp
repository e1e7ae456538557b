#include "instances/io/modbus/server/server.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include "instances/io/modbus/config/endpoint.hpp"
#include "shm/base/system_call.hpp"
#include "shm/log/log.hpp"

namespace plchost::modbus {

namespace {

constexpr int kBacklog = 16;
constexpr std::chrono::milliseconds kAcceptPause{100};

}  // namespace

Result<std::unique_ptr<Server>> Server::listen(const ServerConfig& config, const ImageTable& images,
                                               const StopEvent& stop) {
  const auto endpoint = parse_endpoint(config.listen);
  if (!endpoint) return failure(ErrorCode::invalid_argument, endpoint.error());
  const std::string where = fmt::format("[server] listen: {}", config.listen);
  PLCHOST_TRY_ASSIGN(
      const int raw,
      check_errno(::socket(endpoint->family(), SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0), where));
  UniqueFd fd(raw);
  const int one = 1;
  PLCHOST_TRY(check_errno(::setsockopt(raw, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one), where));
  PLCHOST_TRY(
      check_errno(::bind(raw, reinterpret_cast<const sockaddr*>(&endpoint->address), endpoint->size), where));
  PLCHOST_TRY(check_errno(::listen(raw, kBacklog), where));
  // Its own socket is never used: it answers at those of the clients.
  modbus_t* const context = modbus_new_tcp("127.0.0.1", kModbusPort);
  if (context == nullptr) return failure(ErrorCode::system, "libmodbus", errno);
  return std::unique_ptr<Server>(new Server(config, images, stop, std::move(fd), context));
}

std::vector<pollfd> Server::watched() const {
  const bool accepts = MonotonicClock::now() >= accept_again_;
  std::vector<pollfd> fds;
  fds.reserve(clients_.size() + 2);
  fds.push_back({.fd = stop_.fd(), .events = POLLIN, .revents = 0});
  fds.push_back({.fd = accepts ? listener_.get() : -1, .events = POLLIN, .revents = 0});
  for (const Client& client : clients_) {
    fds.push_back({.fd = client.fd.get(), .events = POLLIN, .revents = 0});
  }
  return fds;
}

TimePoint Server::next_deadline() const noexcept {
  TimePoint next = MonotonicClock::now() + config_.idle_timeout;
  if (accept_again_ > MonotonicClock::now()) next = std::min(next, accept_again_);
  for (const Client& client : clients_) next = std::min(next, client.deadline);
  return next;
}

void Server::run() {
  while (true) {
    std::vector<pollfd> fds = watched();
    const timespec left = to_timespec(std::max(next_deadline() - MonotonicClock::now(), Duration::zero()));
    if (::ppoll(fds.data(), fds.size(), &left, nullptr) < 0 && errno != EINTR) {
      spdlog::error("the server ends: poll: {}", std::strerror(errno));
      return;
    }
    if (fds[0].revents != 0) return;
    const TimePoint now = MonotonicClock::now();
    for (std::size_t i = 0; i < clients_.size(); ++i) {
      Client& client = clients_[i];
      const bool good = fds[i + 2].revents == 0 || serve(client, now);
      if (!good || now >= client.deadline) client.fd.reset();
    }
    std::erase_if(clients_, [](const Client& client) { return !client.fd; });
    if (fds[1].revents != 0) accept_clients(now);
  }
}

// Those that come meanwhile are accepted in the next round.
void Server::accept_clients(TimePoint now) {
  for (int i = 0; i < kBacklog; ++i) {
    UniqueFd fd(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!fd && (errno == EINTR || errno == ECONNABORTED)) continue;
    if (!fd) {
      if (errno != EAGAIN) accept_again_ = now + kAcceptPause;  // out of descriptors, say
      return;
    }
    if (clients_.size() >= config_.connections) {
      if (full_pause_.is_over(now)) {
        spdlog::warn("a client of the server is refused: all {} connections are in use", clients_.size());
      }
      continue;
    }
    const int one = 1;
    (void)::setsockopt(fd.get(), IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
    Client& client = clients_.emplace_back();
    client.fd = std::move(fd);
    client.deadline = now + config_.idle_timeout;
  }
}

// False: the connection is to be closed.
bool Server::serve(Client& client, TimePoint now) {
  const ssize_t got =
      ::recv(client.fd.get(), client.received.data() + client.size, client.received.size() - client.size, 0);
  if (got < 0) return errno == EAGAIN || errno == EINTR;
  if (got == 0) return false;
  client.size += static_cast<std::size_t>(got);
  return answer_frames(client, now);
}

// A whole frame always fits, so there is room for the next byte afterwards.
bool Server::answer_frames(Client& client, TimePoint now) {
  modbus_set_socket(context_.get(), client.fd.get());
  std::span<const std::uint8_t> rest = std::span(client.received).first(client.size);
  Frame frame = first_frame(rest);
  for (; frame.state == FrameState::whole; frame = first_frame(rest)) {
    if (!answer(context_.get(), maps_, rest.first(frame.size))) return false;
    rest = rest.subspan(frame.size);
    client.deadline = now + config_.idle_timeout;
  }
  if (frame.state == FrameState::garbage) {
    if (garbage_pause_.is_over(now))
      spdlog::warn("a client of the server sends no Modbus; it is disconnected");
    return false;
  }
  std::memmove(client.received.data(), rest.data(), rest.size());
  client.size = rest.size();
  return true;
}

}  // namespace plchost::modbus
