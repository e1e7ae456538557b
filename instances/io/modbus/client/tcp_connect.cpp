#include "instances/io/modbus/client/tcp_connect.hpp"

#include <cerrno>
#include <cstring>

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include "shm/base/system_call.hpp"

namespace plchost::modbus {

namespace {

// A connection to a free port of this machine may end in itself, and answers each request with that request.
bool is_with_itself(int fd) noexcept {
  Endpoint here;
  Endpoint there;
  here.size = there.size = sizeof(sockaddr_storage);
  if (::getsockname(fd, reinterpret_cast<sockaddr*>(&here.address), &here.size) != 0) return false;
  if (::getpeername(fd, reinterpret_cast<sockaddr*>(&there.address), &there.size) != 0) return false;
  return here.size == there.size && std::memcmp(&here.address, &there.address, here.size) == 0;
}

}  // namespace

Result<UniqueFd> tcp_connect(const Endpoint& endpoint, TimePoint deadline, const StopEvent* stop) {
  UniqueFd fd(::socket(endpoint.family(), SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, IPPROTO_TCP));
  if (!fd) return failure(ErrorCode::system, "socket", errno);
  const int one = 1;
  PLCHOST_TRY(check_errno(::setsockopt(fd.get(), IPPROTO_TCP, TCP_NODELAY, &one, sizeof one), "TCP_NODELAY"));
  const int connected =
      ::connect(fd.get(), reinterpret_cast<const sockaddr*>(&endpoint.address), endpoint.size);
  if (connected != 0 && errno != EINPROGRESS) return failure(ErrorCode::unavailable, "cannot connect", errno);
  if (!wait_for(fd.get(), POLLOUT, deadline, stop))
    return failure(ErrorCode::timed_out, "connect: no answer");
  int error = 0;
  socklen_t size = sizeof error;
  PLCHOST_TRY(check_errno(::getsockopt(fd.get(), SOL_SOCKET, SO_ERROR, &error, &size), "SO_ERROR"));
  if (error != 0) return failure(ErrorCode::unavailable, "cannot connect", error);
  if (is_with_itself(fd.get())) return failure(ErrorCode::unavailable, "connect: nothing listens there");
  return fd;
}

}  // namespace plchost::modbus
