#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

/// The manager's one thread: waits for descriptors, timers and signals, and calls back, one at a time. All
/// functions only from that thread. Callbacks may add and remove watches and timers, their own included.
class Reactor {
 public:
  using Ready = std::function<void(std::uint32_t epoll_events)>;

  /// Calls back while a descriptor is ready, until it is destroyed. The descriptor must outlive it.
  class Watch {
   public:
    Watch() noexcept = default;
    Watch(Watch&& other) noexcept
        : reactor_(std::exchange(other.reactor_, nullptr)), id_(other.id_), fd_(other.fd_) {}
    Watch& operator=(Watch&& other) noexcept;
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;
    ~Watch() { reset(); }

    void reset() noexcept;
    /// Waits for other events of the same descriptor from now on.
    [[nodiscard]] Result<void> change(std::uint32_t epoll_events);
    [[nodiscard]] explicit operator bool() const noexcept { return reactor_ != nullptr; }

   private:
    friend class Reactor;
    Watch(Reactor& reactor, std::uint64_t id, int fd) noexcept : reactor_(&reactor), id_(id), fd_(fd) {}
    Reactor* reactor_ = nullptr;
    std::uint64_t id_ = 0;
    int fd_ = -1;
  };

  /// Calls back once when its time has come; may be set again from there.
  class Timer {
   public:
    Timer(Reactor& reactor, std::function<void()> expired)
        : reactor_(reactor), expired_(std::move(expired)) {}
    Timer(const Timer&) = delete;
    Timer& operator=(const Timer&) = delete;
    ~Timer() { cancel(); }

    void set(TimePoint when);
    void cancel() noexcept;

   private:
    friend class Reactor;
    Reactor& reactor_;
    std::function<void()> expired_;
    std::multimap<TimePoint, Timer*>::iterator place_{};
    bool set_ = false;
  };

  [[nodiscard]] static Result<std::unique_ptr<Reactor>> create();
  Reactor(const Reactor&) = delete;
  Reactor& operator=(const Reactor&) = delete;

  [[nodiscard]] Result<Watch> watch(int fd, std::uint32_t epoll_events, Ready ready);
  /// Blocks these signals for the process and calls back with their numbers instead. Once.
  [[nodiscard]] Result<void> watch_signals(std::initializer_list<int> signals,
                                           std::function<void(int)> received);

  /// Until stop().
  [[nodiscard]] Result<void> run();
  void stop() noexcept { stopped_ = true; }

 private:
  explicit Reactor(UniqueFd epoll) noexcept : epoll_(std::move(epoll)) {}
  void remove(std::uint64_t id, int fd) noexcept;
  void run_timers();
  [[nodiscard]] int wait_milliseconds() const;

  UniqueFd epoll_;
  UniqueFd signal_fd_;
  std::uint64_t next_id_ = 1;
  // By number and not by descriptor: a descriptor that was closed and opened anew in one round is another.
  std::map<std::uint64_t, std::unique_ptr<Ready>> watches_;
  std::vector<std::unique_ptr<Ready>> removed_;  // may be running right now: destroyed after the round
  std::multimap<TimePoint, Timer*> timers_;
  Watch signal_watch_;
  bool stopped_ = false;
};

}  // namespace plchost
