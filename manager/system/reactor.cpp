#include "manager/system/reactor.hpp"

#include <algorithm>
#include <array>
#include <csignal>

#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"

namespace plchost {

Reactor::Watch& Reactor::Watch::operator=(Watch&& other) noexcept {
  if (this != &other) {
    reset();
    reactor_ = std::exchange(other.reactor_, nullptr);
    id_ = other.id_;
    fd_ = other.fd_;
  }
  return *this;
}

void Reactor::Watch::reset() noexcept {
  if (auto* reactor = std::exchange(reactor_, nullptr)) reactor->remove(id_, fd_);
}

Result<void> Reactor::Watch::change(std::uint32_t epoll_events) {
  epoll_event event{.events = epoll_events, .data = {.u64 = id_}};
  PLCHOST_TRY(
      check_errno(::epoll_ctl(reactor_->epoll_.get(), EPOLL_CTL_MOD, fd_, &event), "cannot change a watch"));
  return {};
}

void Reactor::Timer::set(TimePoint when) {
  cancel();
  place_ = reactor_.timers_.emplace(when, this);
  set_ = true;
}

void Reactor::Timer::cancel() noexcept {
  if (std::exchange(set_, false)) reactor_.timers_.erase(place_);
}

Result<std::unique_ptr<Reactor>> Reactor::create() {
  PLCHOST_TRY_ASSIGN(auto epoll,
                     check_errno(::epoll_create1(EPOLL_CLOEXEC), "cannot create an epoll descriptor"));
  return std::unique_ptr<Reactor>(new Reactor(UniqueFd(epoll)));  // NOLINT: the constructor is private
}

Result<Reactor::Watch> Reactor::watch(int fd, std::uint32_t epoll_events, Ready ready) {
  const std::uint64_t id = next_id_++;
  epoll_event event{.events = epoll_events, .data = {.u64 = id}};
  PLCHOST_TRY(check_errno(::epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, fd, &event), "cannot watch a descriptor"));
  watches_.emplace(id, std::make_unique<Ready>(std::move(ready)));
  return Watch(*this, id, fd);
}

void Reactor::remove(std::uint64_t id, int fd) noexcept {
  ::epoll_ctl(epoll_.get(), EPOLL_CTL_DEL, fd, nullptr);
  const auto found = watches_.find(id);
  if (found == watches_.end()) return;
  removed_.push_back(std::move(found->second));
  watches_.erase(found);
}

Result<void> Reactor::watch_signals(std::initializer_list<int> signals, std::function<void(int)> received) {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : signals) sigaddset(&set, signal);
  if (auto blocked = check_returned(pthread_sigmask(SIG_BLOCK, &set, nullptr), "cannot block signals");
      !blocked) {
    return blocked;
  }
  PLCHOST_TRY_ASSIGN(auto fd, check_errno(::signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK),
                                          "cannot create a signal descriptor"));
  signal_fd_ = UniqueFd(fd);
  const auto read_all = [this, received = std::move(received)](std::uint32_t) {
    signalfd_siginfo info{};
    while (::read(signal_fd_.get(), &info, sizeof info) == sizeof info) {
      received(static_cast<int>(info.ssi_signo));
    }
  };
  PLCHOST_TRY_ASSIGN(signal_watch_, watch(fd, EPOLLIN, read_all));
  return {};
}

int Reactor::wait_milliseconds() const {
  if (timers_.empty()) return -1;
  // Rounded up: waking early would only mean to wait again.
  const auto left =
      std::chrono::ceil<std::chrono::milliseconds>(timers_.begin()->first - MonotonicClock::now()).count();
  constexpr std::chrono::milliseconds::rep kLongest = 60'000;
  return static_cast<int>(std::clamp<std::chrono::milliseconds::rep>(left, 0, kLongest));
}

void Reactor::run_timers() {
  // Only those that are due now: a timer that sets itself again for now waits for the next round.
  const TimePoint now = MonotonicClock::now();
  for (std::size_t left = timers_.size(); left > 0; --left) {
    if (timers_.empty() || timers_.begin()->first > now) return;
    Timer& timer = *timers_.begin()->second;
    timer.cancel();
    timer.expired_();
  }
}

Result<void> Reactor::run() {
  constexpr std::size_t kEventsPerRound = 64;
  std::array<epoll_event, kEventsPerRound> events{};
  stopped_ = false;
  while (!stopped_) {
    const int count = ::epoll_wait(epoll_.get(), events.data(), kEventsPerRound, wait_milliseconds());
    if (count < 0 && errno != EINTR) return failure(ErrorCode::system, "cannot wait for events", errno);
    for (int i = 0; i < count; ++i) {
      const epoll_event event = events[static_cast<std::size_t>(i)];
      const std::uint64_t id = event.data.u64;  // packed: no reference to it
      const auto found = watches_.find(id);
      if (found != watches_.end()) (*found->second)(event.events);
    }
    run_timers();
    removed_.clear();
  }
  return {};
}

}  // namespace plchost
