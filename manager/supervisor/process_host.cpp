#include "manager/supervisor/process_host.hpp"

#include <algorithm>
#include <csignal>
#include <utility>

#include <fmt/format.h>
#include <sys/epoll.h>
#include <unistd.h>

#include "manager/supervisor/instance_files.hpp"
#include "manager/supervisor/lost_faults.hpp"
#include "manager/system/take_packets.hpp"
#include "manager/system/thread_states.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/log/log.hpp"
#include "shm/pages/debug_page.hpp"

namespace plchost {

ProcessHost::ProcessHost(Reactor& reactor, Settings settings)
    : reactor_(reactor),
      settings_(std::move(settings)),
      output_({.pool = settings_.pool, .instance = settings_.name, .run_directory = settings_.run_directory}),
      timer_(reactor, [this] { events_->on_timer(); }),
      check_timer_(reactor, [this] { check_timed_out(); }) {}

Result<int> ProcessHost::spawn(const LaunchOptions& options) {
  if (settings_.prepare) settings_.prepare();
  PLCHOST_TRY_ASSIGN(auto channel, make_report_channel());
  const auto output = output_.open_for_process();
  if (!output) {  // better a PLC whose words are not kept than none
    spdlog::warn("instance {}: its output is not kept: {}", settings_.name, output.error().describe());
  }
  const Share share = settings_.share ? settings_.share() : Share{};
  LaunchOptions launch = options;
  launch.control_group = make_group(share.limits);
  launch.oom_score = share.oom_score;
  PLCHOST_TRY_ASSIGN(auto process, spawn_process({.arguments = to_arguments(settings_.program, launch),
                                                  .report_fd = channel.childs.get(),
                                                  .output_fd = output ? output->get() : -1}));
  const int pid = process.pid;
  output_.say(LogLevel::info, pid, fmt::format("process {} was started", pid));
  auto watch = reactor_.watch(channel.ours.fd(), EPOLLIN, [this](std::uint32_t) { read_reports(); });
  auto followed = and_then(watch, [&](const auto& /*watching*/) { return follow(process); });
  if (!followed) {  // it cannot be supervised, so it must not go on
    kill_and_reap(process);
    return std::unexpected(followed.error());
  }
  report_ = std::move(channel.ours);
  report_watch_ = std::move(*watch);
  return pid;
}

std::string ProcessHost::group_name() const {
  return control_group_name(settings_.pool, settings_.name);
}

bool ProcessHost::name_is_held() const {
  return std::ranges::any_of(
      claims_of(
          {.instance = settings_.name, .pool = settings_.pool, .run_directory = settings_.run_directory}),
      [](const std::string& claim) { return user_that_holds(claim).has_value(); });
}

// A process that ended while no manager ran may have left others in the group.
std::string ProcessHost::make_group(const GroupLimits& limits) {
  if (settings_.groups == nullptr || !settings_.groups->problem().empty()) return {};
  if (!name_is_held()) settings_.groups->kill(group_name());
  const auto made = settings_.groups->make(group_name(), limits);
  if (!made) {
    spdlog::warn("instance {}: its limits do not hold: {}", settings_.name, made.error().describe());
    return {};
  }
  for (const std::string& refused : made->refused)
    spdlog::warn("instance {}: a limit does not hold: {}", settings_.name, refused);
  return made->folder;
}

Result<int> ProcessHost::adopt() {
  PLCHOST_TRY(connect());
  const auto pid = adopt_peer();
  if (!pid) {  // the process at the other end is not the instance: a link to it would stay silent
    link_watch_.reset();
    link_.close();
  }
  return pid;
}

Result<int> ProcessHost::adopt_peer() {
  PLCHOST_TRY_ASSIGN(const auto pid, link_.peer_pid());
  PLCHOST_TRY_ASSIGN(auto process, open_process(pid));
  // Looked at again: had it ended before, its number could mean another process by now.
  if (link_.is_cut()) return failure(ErrorCode::unavailable, fmt::format("process {} has ended", pid));
  // A process could have given its socket to another one and ended; its number may be a stranger's by now.
  PLCHOST_TRY_ASSIGN(const auto user, link_.peer_user());
  if (user_of_process(pid) != user)
    return failure(ErrorCode::refused,
                   fmt::format("process {} is not of user {}, as its socket is", pid, user));
  PLCHOST_TRY(follow(process));
  if (settings_.groups != nullptr) settings_.groups->take_over(group_name());
  output_.adopt();
  output_.say(LogLevel::info, pid, fmt::format("a new manager has adopted process {}", pid));
  return pid;
}

Result<void> ProcessHost::follow(ChildProcess& process) {
  PLCHOST_TRY_ASSIGN(
      auto watch, reactor_.watch(process.pidfd.get(), EPOLLIN, [this](std::uint32_t) { process_ended(); }));
  process_ = std::move(process);
  exit_watch_ = std::move(watch);
  return {};
}

Result<void> ProcessHost::connect() {
  PLCHOST_TRY_ASSIGN(auto socket,
                     PacketSocket::connect(instance_socket_path(settings_.run_directory, settings_.name)));
  PLCHOST_TRY_ASSIGN(auto watch,
                     reactor_.watch(socket.fd(), EPOLLIN, [this](std::uint32_t) { read_replies(); }));
  link_watch_.reset();
  link_ = std::move(socket);
  link_watch_ = std::move(watch);
  return {};
}

Result<void> ProcessHost::request(const ControlRequest& request) {
  if (!link_) {
    if (auto connected = connect(); !connected) return connected;
  }
  return link_.send(encode(request));
}

// The process takes nothing from a connection whose other end is closed.
void ProcessHost::forget_requests() {
  link_watch_.reset();
  link_.close();
}

void ProcessHost::signal(int signal) {
  if (!process_) return;
  if (const auto sent = signal_process(*process_, signal); !sent) {
    spdlog::error("instance {}: {}", settings_.name, sent.error().describe());
  }
}

void ProcessHost::set_timer(std::optional<TimePoint> when) {
  if (when) {
    timer_.set(*when);
  } else {
    timer_.cancel();
  }
}

// The lines of the process come before those of the manager about it.
void ProcessHost::read_reports() {
  read_output();
  take_packets(report_, report_watch_, [this](std::string_view packet) {
    if (const auto report = decode_report(packet)) {
      events_->on_report(*report);
    } else {
      spdlog::warn("instance {}: {}", settings_.name, report.error().describe());
    }
  });
}

void ProcessHost::read_replies() {
  take_packets(link_, link_watch_, [this](std::string_view packet) {
    if (const auto reply = decode_reply(packet)) {
      events_->on_reply(*reply);
    } else {
      spdlog::warn("instance {}: {}", settings_.name, reply.error().describe());
    }
  });
}

// All that is left in it. Whether the kernel has ended a process there for want of memory.
bool ProcessHost::end_group() {
  // The process that ended may have been put into the group of another one that has the name.
  if (settings_.groups == nullptr || name_is_held()) return false;
  const bool out_of_memory = settings_.groups->counts(group_name()).oom_kills != 0;
  settings_.groups->end(group_name());
  return out_of_memory;
}

// The one place where an instance's exit is reaped. Its last report explains the exit, so it comes first.
void ProcessHost::process_ended() {
  withdraw();  // first: machines wait for it
  read_reports();
  read_replies();
  end_session(*process_);
  const bool out_of_memory = end_group();
  // It may have ended before it wrote down the fault of a task.
  if (const auto left = left_runtime(); left && left->pid == process_->pid) (void)keep_lost_faults();
  output_.end(process_->pid);
  ExitStatus status = reap_process(*process_);
  // Else the kernel has ended a child of the application earlier.
  const bool by_kernel = status.kind == ExitStatus::Kind::killed && status.value == SIGKILL;
  status.out_of_memory = out_of_memory && (by_kernel || !status.known);
  output_.say(status.success() ? LogLevel::info : LogLevel::warning, process_->pid,
              fmt::format("process {}: {}", process_->pid, status.describe()));
  spdlog::info("instance {}: process {}: {}", settings_.name, process_->pid, status.describe());
  forget_process();
  events_->on_exit(status);
}

void ProcessHost::forget_process() {
  exit_watch_.reset();
  report_watch_.reset();
  link_watch_.reset();
  report_.close();
  link_.close();
  page_.reset();
  process_.reset();
}

bool ProcessHost::has_met_pids_max() const {
  return settings_.groups != nullptr && settings_.groups->counts(group_name()).pids_refused != 0;
}

Result<void> ProcessHost::check_application(const LaunchOptions& options) {
  LaunchOptions launch = options;
  launch.control_group = settings_.trial_group.begin();
  auto trial = ApplicationTrial::start(settings_.program, launch);
  auto watch = and_then(trial, [&](const auto& started) {
    return reactor_.watch(started.fd(), EPOLLIN, [this](std::uint32_t) { check_ended(); });
  });
  if (!watch) {
    if (trial) trial->give_up();
    settings_.trial_group.end();
    return std::unexpected(watch.error());
  }
  check_ = std::move(*trial);
  check_watch_ = std::move(*watch);
  check_timer_.set(MonotonicClock::now() + kTrialLimit);
  return {};
}

void ProcessHost::check_timed_out() {
  if (!check_) return;
  const Duration left = check_->time_left();
  if (left > Duration::zero()) return check_timer_.set(MonotonicClock::now() + left);
  check_->give_up();  // check_ended() says the rest
}

void ProcessHost::check_ended() {
  const auto verdict = check_->verdict();
  settings_.trial_group.end();
  check_timer_.cancel();
  check_watch_.reset();
  check_.reset();
  events_->on_application_checked(verdict);
}

std::optional<InstanceRuntime> ProcessHost::runtime() {
  if (!process_) return std::nullopt;
  auto current = page_ ? page_->runtime() : std::nullopt;
  if (!current || current->pid != process_->pid) {
    auto opened = InstancePageReader::open(settings_.pool, settings_.name);
    if (!opened) return std::nullopt;
    page_ = std::move(*opened);
    current = page_->runtime();
  }
  return current;
}

std::optional<InstanceRuntime> ProcessHost::left_runtime() const {
  const auto left = InstancePageReader::open(settings_.pool, settings_.name);
  return left ? left->runtime() : std::nullopt;
}

bool ProcessHost::can_be_debugged() const {
  return ::access(MemoryFile::path(debug_page_name(settings_.pool, settings_.name)).c_str(), F_OK) == 0;
}

void ProcessHost::withdraw() {
  end_outputs_of(settings_.pool, settings_.name);
  settings_.withdraw_events();
  DebugPage::remove(settings_.pool, settings_.name);  // nothing halts there any more
}

std::string ProcessHost::keep_lost_faults() {
  return plchost::keep_lost_faults(settings_.pool, settings_.run_directory, settings_.name);
}

void ProcessHost::read_output() {
  if (process_) output_.read(process_->pid);
}

ProcessorUse ProcessHost::processor_use() {
  ProcessorUse use;
  if (!process_) return use;
  use.used = processor_time_of(process_->pid);
  for (const ThreadState& thread : threads_of_process(process_->pid)) {
    if (thread.ready) use.ready.push_back({.id = thread.id, .used = thread.used});
  }
  return use;
}

ProcessorShare ProcessHost::processor_share() {
  return process_ ? processor_share_of(process_->pid) : ProcessorShare{};
}

std::string ProcessHost::processor_taker() {
  const auto first = process_ ? first_on_cores(granted_cores(), process_->pid) : std::nullopt;
  return first ? describe(*first) : std::string();
}

std::vector<int> ProcessHost::granted_cores() {
  return process_ ? cores_of_process(process_->pid) : std::vector<int>();
}

}  // namespace plchost
