#include "shm/sockets/packet_socket.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"

namespace plchost {

namespace {

Result<sockaddr_un> to_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) {
    return failure(
        ErrorCode::invalid_argument,
        fmt::format("socket path '{}' must have 1 to {} characters; choose a shorter run directory", path,
                    sizeof address.sun_path - 1));
  }
  std::ranges::copy(path, std::begin(address.sun_path));
  return address;
}

Result<UniqueFd> make_socket() {
  PLCHOST_TRY_ASSIGN(const auto fd,
                     check_errno(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0),
                                 "cannot create a socket"));
  return UniqueFd(fd);
}

/// Also where this user may not go: the folder that keeps it out is often far above the socket.
std::string kept_out_by(const std::string& path) {
  for (auto end = path.find('/', 1); end != std::string::npos; end = path.find('/', end + 1)) {
    const std::string folder = path.substr(0, end);
    if (::faccessat(AT_FDCWD, folder.c_str(), X_OK, AT_EACCESS) == 0) continue;
    return fmt::format("user {} may not enter {}", ::geteuid(), folder);
  }
  return fmt::format("user {} may not write to it", ::geteuid());
}

const sockaddr* as_sockaddr(const sockaddr_un& address) {
  return reinterpret_cast<const sockaddr*>(&address);  // the sockets API is made that way
}

}  // namespace

Result<PacketSocket> PacketSocket::connect(const std::string& path) {
  PLCHOST_TRY_ASSIGN(const auto address, to_address(path));
  PLCHOST_TRY_ASSIGN(auto fd, make_socket());
  if (::connect(fd.get(), as_sockaddr(address), sizeof address) != 0) {
    const int error = errno;
    if (error == EACCES) {
      return failure(ErrorCode::unavailable, fmt::format("cannot connect to {}: {}", path, kept_out_by(path)),
                     error);
    }
    // A non-blocking connect says EAGAIN when the listener's backlog is full.
    return failure(error == EAGAIN ? ErrorCode::busy : ErrorCode::unavailable,
                   fmt::format("cannot connect to {}", path), error);
  }
  return PacketSocket(std::move(fd));
}

Result<void> PacketSocket::send(std::string_view packet) {
  if (packet.empty() || packet.size() > kMaxPacket) {  // an empty one would look like the end of the peer
    return failure(ErrorCode::invalid_argument,
                   fmt::format("packet of {} bytes; 1 to {} are allowed", packet.size(), kMaxPacket));
  }
  while (::send(fd_.get(), packet.data(), packet.size(), MSG_NOSIGNAL) < 0) {
    if (errno == EINTR) continue;
    const bool full = errno == EAGAIN || errno == EWOULDBLOCK;
    return failure(full ? ErrorCode::busy : ErrorCode::unavailable, "cannot send on the control socket",
                   errno);
  }
  return {};
}

Result<std::optional<std::string>> PacketSocket::receive() {
  std::array<char, kMaxPacket + 1> buffer;  // NOLINT: filled by recv
  ssize_t length = 0;
  do {
    length = ::recv(fd_.get(), buffer.data(), buffer.size(), 0);
  } while (length < 0 && errno == EINTR);
  if (length < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return std::nullopt;
  if (length < 0) return failure(ErrorCode::unavailable, "cannot receive from the control socket", errno);
  if (length == 0) return failure(ErrorCode::unavailable, "the other end of the control socket is closed");
  if (static_cast<std::size_t>(length) > kMaxPacket) {
    return failure(ErrorCode::corrupt, fmt::format("packet larger than {} bytes", kMaxPacket));
  }
  return std::string(buffer.data(), static_cast<std::size_t>(length));
}

namespace {

Result<ucred> credentials_of_peer(int fd) {
  ucred credentials{};
  socklen_t size = sizeof credentials;
  PLCHOST_TRY(check_errno(::getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &size),
                          "cannot read the peer of a socket"));
  return credentials;
}

}  // namespace

Result<int> PacketSocket::peer_pid() const {
  PLCHOST_TRY_ASSIGN(const auto credentials, credentials_of_peer(fd_.get()));
  return static_cast<int>(credentials.pid);
}

Result<uid_t> PacketSocket::peer_user() const {
  PLCHOST_TRY_ASSIGN(const auto credentials, credentials_of_peer(fd_.get()));
  return credentials.uid;
}

bool PacketSocket::is_cut() const noexcept {
  pollfd end{.fd = fd_.get(), .events = 0, .revents = 0};
  return ::poll(&end, 1, 0) > 0;  // without events, only its end or an error
}

Result<PacketListener> PacketListener::listen(const std::string& path) {
  PLCHOST_TRY_ASSIGN(const auto address, to_address(path));
  PLCHOST_TRY_ASSIGN(auto fd, make_socket());
  ::unlink(path.c_str());
  constexpr mode_t kMode = 0660;
  constexpr int kBacklog = 16;
  PLCHOST_TRY(check_errno(::bind(fd.get(), as_sockaddr(address), sizeof address), "cannot bind " + path));
  PLCHOST_TRY(check_errno(::chmod(path.c_str(), kMode), "cannot set the rights of " + path));
  PLCHOST_TRY(check_errno(::listen(fd.get(), kBacklog), "cannot listen on " + path));
  struct stat file{};
  PLCHOST_TRY(check_errno(::stat(path.c_str(), &file), "cannot examine " + path));
  return PacketListener(std::move(fd), path, file.st_ino);
}

PacketListener& PacketListener::operator=(PacketListener&& other) noexcept {
  if (this != &other) {
    remove_file();
    fd_ = std::move(other.fd_);
    path_ = std::move(other.path_);
    inode_ = other.inode_;
  }
  return *this;
}

PacketListener::~PacketListener() {
  remove_file();
}

void PacketListener::remove_file() noexcept {
  // Another listener may have taken the path over since; its file is not ours to remove.
  struct stat file{};
  if (fd_ && ::stat(path_.c_str(), &file) == 0 && file.st_ino == inode_) ::unlink(path_.c_str());
}

Result<std::optional<PacketSocket>> PacketListener::accept() {
  const int fd = ::accept4(fd_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd >= 0) return PacketSocket(UniqueFd(fd));
  if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR || errno == ECONNABORTED) return std::nullopt;
  return failure(ErrorCode::system, fmt::format("cannot accept on {}", path_), errno);
}

}  // namespace plchost
