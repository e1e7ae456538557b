// plc-instance: one PLC runtime.

#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include <fmt/format.h>
#include <linux/capability.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include "instances/runtime/instance/instance.hpp"
#include "instances/runtime/memory/retain_keeper.hpp"
#include "instances/runtime/settings/read_settings.hpp"
#include "instances/runtime/setup/options.hpp"
#include "instances/runtime/setup/own_group.hpp"
#include "instances/runtime/setup/own_user.hpp"
#include "instances/runtime/trial/trial.hpp"
#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/files/memory_rights.hpp"
#include "shm/guard/memory_guard.hpp"
#include "shm/log/log.hpp"
#include "shm/process/capabilities.hpp"
#include "shm/process/end_with_parent.hpp"

namespace plchost {

namespace {

// The mask is set as a whole: we have these two, whatever the starter had blocked. Before any thread is made.
Result<UniqueFd> take_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  ::sigprocmask(SIG_SETMASK, &signals, nullptr);
  UniqueFd fd(::signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK));
  if (!fd) return failure(ErrorCode::system, "cannot create a signal descriptor", errno);
  return fd;
}

Result<UniqueFd> start_heartbeat() {
  UniqueFd fd(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK));
  if (!fd) return failure(ErrorCode::system, "cannot create a timer", errno);
  const timespec interval = to_timespec(Duration(Instance::kHeartbeat));
  const itimerspec timer{.it_interval = interval, .it_value = interval};
  PLCHOST_TRY(check_errno(::timerfd_settime(fd.get(), 0, &timer, nullptr), "cannot set a timer"));
  return fd;
}

// Until a signal or a client asks for the end.
Result<void> serve(Instance& instance, const UniqueFd& signals, const UniqueFd& heartbeat) {
  std::array<pollfd, 6> fds{{{.fd = signals.get(), .events = POLLIN, .revents = 0},
                             {.fd = heartbeat.get(), .events = POLLIN, .revents = 0},
                             {.fd = instance.control_fd(), .events = POLLIN, .revents = 0},
                             {.fd = instance.fault_fd(), .events = POLLIN, .revents = 0},
                             {.fd = instance.values_fd(), .events = POLLIN, .revents = 0},
                             {.fd = instance.debug_fd(), .events = POLLIN, .revents = 0}}};
  while (!instance.ended()) {
    const auto soon = instance.wants_advance_in();
    const timespec timeout = to_timespec(soon.value_or(Duration::zero()));
    if (::ppoll(fds.data(), fds.size(), soon ? &timeout : nullptr, nullptr) < 0) {
      if (errno == EINTR) continue;
      return failure(ErrorCode::system, "cannot wait for events", errno);
    }
    signalfd_siginfo signal{};
    if (fds[0].revents != 0 && ::read(signals.get(), &signal, sizeof signal) > 0) {
      spdlog::info("a signal asks for the end");
      instance.begin_shutdown("a signal asks for the end");
    }
    std::uint64_t expirations = 0;
    if (fds[1].revents != 0 && ::read(heartbeat.get(), &expirations, sizeof expirations) > 0) instance.beat();
    if (fds[3].revents != 0) instance.serve_faults();  // first: later requests find the state right
    if (fds[2].revents != 0) instance.serve_control();
    if (fds[4].revents != 0) instance.serve_values();
    instance.advance();
  }
  return {};
}

int check_settings(const std::string& file) {
  const auto settings = read_settings(file);
  if (!settings) {
    fmt::print(stderr, "{}\n", settings.error().describe());
    return kExitSetupFailed;
  }
  for (const std::string& remark : settings->remarks) fmt::print("{}\n", remark);
  fmt::print("{}: ok\n", file);
  return EXIT_SUCCESS;
}

// Line by line, so that the last lines of an application before a crash are written. A line of up to 4096
// bytes goes into a pipe whole or not at all.
void print_line_by_line() noexcept {
  static std::array<char, 4096> buffer;
  (void)std::setvbuf(stdout, buffer.data(), _IOLBF, buffer.size());
}

// As a step that failed: the manager repeats a start for which the host was short of something.
int refuse_start(const Options& options, const Error& error) {
  SetupReporter(options.launch.report_fd).failed(SetupStep::bind_core, error);
  return kExitSetupFailed;
}

// As a service the manager has these for its children. By hand a process keeps what it was given. One that is
// to be another user gives up all of its rights later. None of them ever gains rights from here on.
Result<void> give_up_rights(const Options& options) {
  const bool of_service = never_gains_rights();
  PLCHOST_TRY(refuse_new_rights());
  if (!of_service || !options.launch.user.empty()) return {};
  return give_up_capabilities({CAP_SETGID, CAP_SETUID});
}

int run(const Options& options) {
  const std::string refused = take_own_group(options.launch);
  if (const auto given_up = give_up_rights(options); !given_up)
    return refuse_start(options, given_up.error());
  for (const unsigned user : options.launch.trusted_users) trust_instances_of(user);
  if (!options.check_settings.empty()) return check_settings(options.check_settings);
  start_log("plc-instance/" + options.launch.name, options.launch.log_level);
  if (!refused.empty()) spdlog::warn("{}", refused);
  const auto signals = take_signals();
  if (!signals) return refuse_start(options, signals.error());
  // An instance itself does that when it has read its settings: idle states are root's to hold.
  const bool helps = !options.check_application.empty() || options.save_retain;
  if (helps && !options.launch.user.empty()) {
    const auto become = become_user_of_instances(options.launch.user, options.launch.pool);
    if (!become) return refuse_start(options, failure_in("--user", become.error()).error());
  }
  if (!options.check_application.empty()) {
    // SIGTERM and not SIGKILL: processes that the application has forked end, too.
    if (options.parent != 0 && !end_with_parent(options.parent, SIGTERM)) return kExitSetupFailed;
    set_log_pattern("%l: %v");  // read by people and told in answers
    return run_trial(options.check_application, signals->get(), [&] { return check_application(options); });
  }
  if (options.save_retain) {
    const auto saved = save_left_behind(options.launch);
    if (!saved) spdlog::error("retain variables are not written: {}", saved.error().describe());
    return saved ? EXIT_SUCCESS : kExitSetupFailed;
  }

  print_line_by_line();
  // Before it is told that the instance is up: nothing that it needs can be missing then.
  const auto heartbeat = start_heartbeat();
  if (!heartbeat) return refuse_start(options, heartbeat.error());
  std::unique_ptr<Instance> instance;
  {
    SetupReporter reporter(options.launch.report_fd);
    instance = Instance::set_up(options, reporter);
  }
  if (!instance) return kExitSetupFailed;
  const auto served = serve(*instance, *signals, *heartbeat);
  if (!served) spdlog::error("{}", served.error().describe());
  if (const auto down = instance->shut_down(); !down) {
    spdlog::error("{}; the process ends without it", down.error().describe());
    std::fflush(nullptr);
    ::_exit(EXIT_FAILURE);  // a thread is still inside the application: nothing may be destroyed
  }
  spdlog::info("ended");
  if (instance->has_parked_thread()) {
    std::fflush(nullptr);
    ::_exit(served ? EXIT_SUCCESS
                   : EXIT_FAILURE);  // it may hold a lock that the application's destructors take
  }
  return served ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace

}  // namespace plchost

int main(int argc, char** argv) {
  plchost::MemoryGuard::watch_process();
  const auto parsed = plchost::parse_options(argc, argv);
  return parsed.options ? plchost::run(*parsed.options) : parsed.exit_code;
}
