#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <ucontext.h>
#include <unistd.h>

#include "instances/launch/launch_contract.hpp"
#include "instances/runtime/application/symbol_name.hpp"
#include "instances/runtime/trial/trial.hpp"
#include "schedulers/faults/fault_trap.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/process/end_with_parent.hpp"
#include "shm/process/work_limit.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

namespace {

/// The message of the handler of a crash to the thread that describes it.
struct TrialCrash {
  int signal = 0;
  std::uintptr_t address = 0;  ///< of the instruction; 0: it says nothing
};

std::atomic<int> crash_pipe = -1;  // the handler has no argument of ours
std::atomic<int> verdict_pipe = -1;

// Signal context: the thread stays where it is, the describing thread ends the process.
void on_trial_crash(int signal, siginfo_t*, void* context) noexcept {
  // abort() is called by the C++ runtime or an assertion, which have said why.
  const TrialCrash crash{
      .signal = signal,
      .address = signal == SIGABRT ? 0 : instruction_of(*static_cast<const ucontext_t*>(context))};
  (void)!::write(crash_pipe.load(), &crash, sizeof crash);
  for (;;) ::pause();
}

void say(std::string_view text) noexcept {
  (void)!::write(STDERR_FILENO, text.data(), text.size());
}

// The crashed thread may hold the lock of the heap: work that needs the heap comes last and has a time limit.
void describe_crash(const std::string& application, int verdict, int crashes) {
  TrialCrash crash;
  ssize_t got = 0;
  do {
    got = ::read(crashes, &crash, sizeof crash);
  } while (got < 0 && errno == EINTR);
  if (got != ssize_t{sizeof crash})
    return;  // the application has closed the pipe: see descriptors_are_open()
  (void)!::write(verdict, &kExitSetupFailed, sizeof kExitSetupFailed);
  const char* const signal = ::sigabbrev_np(crash.signal);
  say(application);
  say(": it crashes in its set-up: SIG");
  say(signal != nullptr ? signal : "?");
  constexpr unsigned kSeconds = 2;
  ::alarm(kSeconds);
  if (const std::string name = name_of(crash.address); !name.empty()) say(" in " + name);
  say("\n");
  ::_exit(kExitSetupFailed);
}

void catch_crashes(const std::string& application, int verdict) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return;  // the parent tells the signal
  crash_pipe = ends[1];
  // Nothing closes it: the application may have closed it and opened a file that has its number now.
  std::thread([&application, verdict, crashes = ends[0]] {
    describe_crash(application, verdict, crashes);
  }).detach();
  struct sigaction action{};
  action.sa_flags = SA_SIGINFO | SA_ONSTACK;
  action.sa_sigaction = &on_trial_crash;
  for (const int signal : kFaultSignals) ::sigaction(signal, &action, nullptr);
}

// The child. The verdict goes to the parent last: an exit code alone could be the application's. A process
// group of its own: the application may send a signal to all of its group, which must not reach the shell or
// script that asked for the trial.
[[noreturn]] void try_out(const std::string& application, const UniqueFd& verdict, pid_t parent,
                          const std::function<int()>& check) {
  if (!end_with_parent(parent, SIGKILL) || ::setpgid(0, 0) != 0) ::_exit(kExitSetupFailed);
  const auto stack = AlternateStack::make();  // a stack that is full is a crash, too
  std::optional<AlternateStack::Use> use;
  if (stack) use.emplace(*stack);
  catch_crashes(application, verdict.get());
  verdict_pipe = verdict.get();
  end_trial(check());
}

struct Trial {
  pid_t pid = -1;
  UniqueFd pidfd;
  UniqueFd verdict;
};

// Processes that the application has forked come to us when their parent ends.
void end_descendants() {
  const std::string children = fmt::format("/proc/self/task/{}/children", ::gettid());
  constexpr int kRounds = 100;  // against one that forks all the time
  for (int round = 0; round < kRounds; ++round) {
    std::ifstream list(children);
    bool any = false;
    for (pid_t pid = 0; list >> pid;) {
      any = true;
      ::kill(pid, SIGKILL);
      ::waitpid(pid, nullptr, 0);
    }
    if (!any) return;
  }
}

std::string how_it_ended(int status) {
  if (WIFEXITED(status)) {
    return fmt::format("it ends its process in its set-up (exit code {})", WEXITSTATUS(status));
  }
  const char* const name = ::sigabbrev_np(WTERMSIG(status));
  return fmt::format("its set-up was ended by SIG{}", name != nullptr ? name : "?");
}

int failed(const std::string& application, std::string_view why) {
  fmt::print(stderr, "{}: {}\n", application, why);
  return kExitSetupFailed;
}

// As if the signal had not been taken: a shell then knows that its Ctrl-C did it.
int end_by(int signals) {
  signalfd_siginfo info{};
  if (::read(signals, &info, sizeof info) != ssize_t{sizeof info}) return kExitSetupFailed;
  const auto signal = static_cast<int>(info.ssi_signo);
  sigset_t only;
  sigemptyset(&only);
  sigaddset(&only, signal);
  (void)std::raise(signal);
  ::sigprocmask(SIG_UNBLOCK, &only, nullptr);
  return kExitSetupFailed;
}

int judge(const std::string& application, const Trial& trial, int signals) {
  std::array<pollfd, 2> fds{{{.fd = trial.pidfd.get(), .events = POLLIN, .revents = 0},
                             {.fd = signals, .events = POLLIN, .revents = 0}}};
  const WorkLimit work(kSetUpLimit, MonotonicClock::now());
  const auto is_over = [&] {
    const timespec wait = to_timespec(work.left(MonotonicClock::now(), processor_share_of(trial.pid)));
    const int ready = ::ppoll(fds.data(), fds.size(), &wait, nullptr);
    if (ready != 0) return ready > 0 || errno != EINTR;
    return work.left(MonotonicClock::now(), processor_share_of(trial.pid)) == Duration::zero();
  };
  while (!is_over()) {
  }
  const bool ended = fds[0].revents != 0;
  if (!ended) ::kill(trial.pid, SIGKILL);
  int status = 0;
  while (::waitpid(trial.pid, &status, 0) < 0 && errno == EINTR) {
  }
  end_descendants();
  if (fds[1].revents != 0) return end_by(signals);
  if (!ended) {
    return failed(application,
                  fmt::format("trying it took longer than {} s: does it return from its set-up?",
                              std::chrono::duration_cast<std::chrono::seconds>(kSetUpLimit).count()));
  }
  int code = 0;
  if (::read(trial.verdict.get(), &code, sizeof code) == ssize_t{sizeof code}) return code;
  return failed(application, how_it_ended(status));
}

}  // namespace

bool descriptors_are_open() noexcept {
  struct stat status{};
  return ::fstat(verdict_pipe, &status) == 0 && S_ISFIFO(status.st_mode);
}

void end_trial(int code) noexcept {
  (void)std::fflush(nullptr);
  (void)!::write(verdict_pipe, &code, sizeof code);
  ::_exit(code);  // without the destructors of the application
}

int run_trial(const std::string& application, int signals, const std::function<int()>& check) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC | O_NONBLOCK) != 0) return failed(application, "cannot be tried: pipe2");
  UniqueFd read_end(ends[0]);
  const UniqueFd write_end(ends[1]);
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  (void)std::fflush(nullptr);
  const pid_t self = ::getpid();
  const pid_t pid = ::fork();
  if (pid < 0) return failed(application, fmt::format("cannot be tried: fork: {}", std::strerror(errno)));
  if (pid == 0) try_out(application, write_end, self, check);
  const Trial trial{.pid = pid,
                    .pidfd = UniqueFd(static_cast<int>(::syscall(SYS_pidfd_open, pid, 0))),
                    .verdict = std::move(read_end)};
  return judge(application, trial, signals);
}

}  // namespace plchost
