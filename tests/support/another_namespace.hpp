#pragma once

#include <array>
#include <utility>

#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace plchost {

/// A process that runs as number 1 in a PID namespace of its own, as in a container. It is killed when this
/// goes.
class InAnotherNamespace {
 public:
  /// `body` runs there, and its result is the process's exit code.
  template <class Body>
  explicit InAnotherNamespace(const Body& body) {
    std::array<int, 2> told{};
    if (::pipe(told.data()) != 0) return;
    outside_ = ::fork();
    if (outside_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      if (::unshare(CLONE_NEWPID) != 0) ::_exit(kNotPermitted);
      const pid_t inside = ::fork();
      if (inside == 0) {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        ::_exit(body());
      }
      (void)!::write(told[1], &inside, sizeof inside);
      int status = 0;
      ::waitpid(inside, &status, 0);
      ::_exit(WIFEXITED(status) ? WEXITSTATUS(status) : kKilled);
    }
    ::close(told[1]);
    permitted_ = ::read(told[0], &inside_, sizeof inside_) == ssize_t{sizeof inside_};
    ::close(told[0]);
  }
  InAnotherNamespace(InAnotherNamespace&& other) noexcept
      : outside_(std::exchange(other.outside_, 0)),
        inside_(std::exchange(other.inside_, 0)),
        permitted_(other.permitted_) {}
  InAnotherNamespace& operator=(InAnotherNamespace&&) = delete;
  ~InAnotherNamespace() { kill(); }

  /// False: this process may not make one.
  [[nodiscard]] bool permitted() const noexcept { return permitted_; }
  /// Its number in the namespace of the caller.
  [[nodiscard]] pid_t pid() const noexcept { return inside_; }
  void signal(int signal) const noexcept { (void)::kill(inside_, signal); }
  /// When this returns, the process has ended.
  void kill() noexcept {
    if (outside_ <= 0) return;
    if (inside_ > 0) signal(SIGKILL);
    (void)wait();
  }
  /// Its exit code; kKilled: it was killed.
  [[nodiscard]] int wait() noexcept {
    int status = 0;
    if (outside_ > 0) ::waitpid(std::exchange(outside_, 0), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : kKilled;
  }
  static constexpr int kNotPermitted = 77;
  static constexpr int kKilled = 78;

 private:
  pid_t outside_ = 0;
  pid_t inside_ = 0;
  bool permitted_ = false;
};

}  // namespace plchost
