#include "instances/io/modbus/threads/stop_event.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

namespace plchost::modbus {

Result<StopEvent> StopEvent::make() {
  UniqueFd fd(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!fd) return failure(ErrorCode::system, "eventfd", errno);
  return StopEvent(std::move(fd));
}

void StopEvent::set() const noexcept {
  const std::uint64_t one = 1;
  while (::write(fd_.get(), &one, sizeof one) < 0 && errno == EINTR) {
  }
}

bool StopEvent::is_set() const noexcept {
  pollfd look{.fd = fd_.get(), .events = POLLIN, .revents = 0};
  return ::poll(&look, 1, 0) > 0;
}

bool StopEvent::wait_until(TimePoint deadline) const noexcept {
  (void)wait_for(-1, 0, deadline, this);
  return is_set();
}

bool wait_for(int fd, short events, TimePoint deadline, const StopEvent* stop) noexcept {
  std::array<pollfd, 2> fds{{{.fd = stop == nullptr ? -1 : stop->fd(), .events = POLLIN, .revents = 0},
                             {.fd = fd, .events = events, .revents = 0}}};
  while (true) {
    const timespec left = to_timespec(std::max(deadline - MonotonicClock::now(), Duration::zero()));
    const int ready = ::ppoll(fds.data(), fds.size(), &left, nullptr);
    if (ready < 0 && errno == EINTR) continue;
    return ready > 0 && fds[0].revents == 0 && fds[1].revents != 0;
  }
}

}  // namespace plchost::modbus
