#pragma once

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <string>

#include <poll.h>

#include "shm/base/time.hpp"
#include "shm/sockets/packet_socket.hpp"

namespace plchost {

/// Waits for a packet until the deadline. timed_out: none came.
[[nodiscard]] inline Result<std::string> receive_until(PacketSocket& socket, TimePoint deadline) {
  for (;;) {
    PLCHOST_TRY_ASSIGN(auto packet, socket.receive());
    if (packet) return std::move(*packet);
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - MonotonicClock::now());
    if (left.count() <= 0) return failure(ErrorCode::timed_out, "no answer on the control socket");
    pollfd poll{.fd = socket.fd(), .events = POLLIN, .revents = 0};
    const auto wait = std::min<std::chrono::milliseconds::rep>(left.count(), 60'000);
    if (::poll(&poll, 1, static_cast<int>(wait)) < 0 && errno != EINTR) {
      return failure(ErrorCode::system, "poll control socket", errno);
    }
  }
}

}  // namespace plchost
