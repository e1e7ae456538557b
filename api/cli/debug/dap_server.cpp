#include "api/cli/debug/dap_server.hpp"

#include <array>
#include <cstdio>
#include <string>
#include <utility>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include "api/cli/debug/dap_messages.hpp"
#include "api/cli/debug/dap_session.hpp"
#include "api/cli/interrupt.hpp"
#include "shm/base/names.hpp"
#include "shm/base/system_call.hpp"
#include "shm/base/time.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

constexpr auto kStateLook = std::chrono::milliseconds(30);
// A client that reads nothing for so long is left.
constexpr int kSendPatienceMs = 2000;
// One that sends no request for so long is none.
constexpr auto kFirstRequest = std::chrono::seconds(5);

Result<UniqueFd> listen_on(std::uint16_t port, std::uint16_t& got) {
  UniqueFd fd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (!fd) return failure(ErrorCode::system, "cannot make a socket", errno);
  const int one = 1;
  (void)::setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &one, sizeof one);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), size) != 0 || ::listen(fd.get(), 1) != 0)
    return failure(ErrorCode::system, fmt::format("cannot listen on port {} of 127.0.0.1", port), errno);
  if (::getsockname(fd.get(), reinterpret_cast<sockaddr*>(&address), &size) != 0)
    return failure(ErrorCode::system, "cannot ask for the port", errno);
  got = ntohs(address.sin_port);
  return fd;
}

// Tells a client that its connection ends.
std::string farewell(const Error& error) {
  const auto event = [](const char* name, nlohmann::json body) {
    return dap_packet({{"seq", 0}, {"type", "event"}, {"event", name}, {"body", std::move(body)}});
  };
  return event("output", {{"category", "stderr"}, {"output", error.describe() + "\n"}}) +
         event("terminated", nlohmann::json::object());
}

/// Clients that come while another one is served.
class RefusedClients {
 public:
  explicit RefusedClients(int listener) noexcept : listener_(listener) {}

  // One of them stays until it has read why, and leaves. If its bytes were not read, it would lose the text.
  void look() {
    std::array<char, 4096> bytes{};
    if (client_ && ::recv(client_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT) == 0) client_ = UniqueFd();
    pollfd ready{.fd = listener_, .events = POLLIN, .revents = 0};
    if (::poll(&ready, 1, 0) <= 0) return;
    client_ = UniqueFd(::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!client_) return;
    const std::string text = farewell(
        {.code = ErrorCode::busy,
         .system_errno = 0,
         .message = "another client is connected, and one is served at a time: disconnect it first"});
    (void)::send(client_.get(), text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    (void)::shutdown(client_.get(), SHUT_WR);
  }

 private:
  int listener_;
  UniqueFd client_;
};

/// One client.
class Connection {
 public:
  Connection(int fd, RefusedClients& others, DebugLink& link, bool take)
      : fd_(fd),
        others_(others),
        session_(link, [this](const nlohmann::json& message) { send(message); }, take) {}

  // Until it leaves, or something is wrong with it.
  Result<void> serve() {
    TimePoint next_look;
    const TimePoint latest_request = MonotonicClock::now() + kFirstRequest;
    while (!over_ && !interrupted()) {
      PLCHOST_TRY_ASSIGN(const bool more, receive());
      if (!more) return {};
      others_.look();
      const TimePoint now = MonotonicClock::now();
      if (!has_asked_ && now >= latest_request) {
        return failure(ErrorCode::timed_out, fmt::format("it has sent no request for {} s",
                                                         kFirstRequest / std::chrono::seconds(1)));
      }
      if (now < next_look) continue;
      next_look = now + kStateLook;
      // A state that changes all the time is looked at again.
      if (auto seen = session_.look(); !seen && seen.error().code != ErrorCode::busy) return seen;
    }
    return {};
  }

  void tell(const Error& error) { send_packet(farewell(error)); }

 private:
  // False: the client has left.
  Result<bool> receive() {
    pollfd ready{.fd = fd_, .events = POLLIN, .revents = 0};
    const int wait = static_cast<int>(kStateLook / std::chrono::milliseconds(1));
    if (::poll(&ready, 1, wait) <= 0) return true;
    std::array<char, 65536> bytes{};
    const ssize_t got = ::recv(fd_, bytes.data(), bytes.size(), 0);
    if (got <= 0) return got < 0 && errno == EINTR;
    reader_.add({bytes.data(), static_cast<std::size_t>(got)});
    for (;;) {
      PLCHOST_TRY_ASSIGN(const auto message, reader_.next());
      if (!message) return true;
      has_asked_ = true;
      if (!session_.obey(*message)) return false;
    }
  }

  void send(const nlohmann::json& message) { send_packet(dap_packet(message)); }

  void send_packet(const std::string& packet) {
    for (std::size_t sent = 0; sent < packet.size() && !over_;) {
      pollfd ready{.fd = fd_, .events = POLLOUT, .revents = 0};
      const bool writable = ::poll(&ready, 1, kSendPatienceMs) > 0;
      const ssize_t count =
          writable ? ::send(fd_, packet.data() + sent, packet.size() - sent, MSG_NOSIGNAL | MSG_DONTWAIT)
                   : -1;
      if (count < 0 && (!writable || (errno != EINTR && errno != EAGAIN))) over_ = true;
      if (count > 0) sent += static_cast<std::size_t>(count);
    }
  }

  int fd_;
  RefusedClients& others_;
  bool over_ = false;
  bool has_asked_ = false;
  DapReader reader_;
  DapSession session_;
};

}  // namespace

Result<void> serve_dap(DebugLink& link, std::uint16_t port, bool take) {
  std::uint16_t got = 0;
  PLCHOST_TRY_ASSIGN(const auto listener, listen_on(port, got));
  catch_interrupts();
  fmt::print("Debug Adapter Protocol for {} on 127.0.0.1:{}\n", link.instance(), got);
  std::fflush(stdout);
  RefusedClients others(listener.get());
  while (!interrupted()) {
    pollfd ready{.fd = listener.get(), .events = POLLIN, .revents = 0};
    if (::poll(&ready, 1, static_cast<int>(kInterruptLook / std::chrono::milliseconds(1))) <= 0) continue;
    const UniqueFd client(::accept4(listener.get(), nullptr, nullptr, SOCK_CLOEXEC));
    if (!client) continue;
    Connection connection(client.get(), others, link, take);
    Result<void> served;
    try {
      served = connection.serve();
    } catch (const nlohmann::json::exception& error) {
      served = failure(ErrorCode::corrupt,
                       fmt::format("a message has another form than expected: {}", printable(error.what())));
    }
    if (served) continue;
    fmt::print(stderr, "plcctl: a client is left: {}\n", printable(served.error().describe()));
    connection.tell(served.error());
  }
  return {};
}

}  // namespace plchost
