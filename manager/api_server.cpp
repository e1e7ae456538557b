#include "manager/api_server.hpp"

#include <algorithm>
#include <csignal>
#include <utility>

#include <fmt/format.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "api/control/application_versions.hpp"
#include "api/control/exit_codes.hpp"
#include "manager/config/accounts.hpp"
#include "manager/server_files.hpp"
#include "manager/system/service_manager.hpp"
#include "shm/files/memory_rights.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

constexpr Duration kRenewLook = std::chrono::milliseconds(50);
// An answer that has left the manager is on its way to the client for 0.3 s at most.
constexpr int kQuietLooks = 6;
constexpr Duration kEndLimit = std::chrono::seconds(2);  // of a process that was asked to end

}  // namespace

std::string audit_folder(const HostConfig& host) {
  return fmt::format("{}/audit.{}", host.state_directory, host.name);
}

ApiServer::ApiServer(Reactor& reactor, const ManagerConfig& config, std::string program,
                     std::function<bool()> is_asked)
    : reactor_(reactor),
      config_(config),
      program_(std::move(program)),
      is_asked_(std::move(is_asked)),
      timer_(reactor, [this] { on_timer(); }),
      beat_timer_(reactor, [this] { look_at_beats(); }),
      renew_timer_(reactor, [this] { look_whether_answered(); }) {}

void ApiServer::start() {
  if (config_.dds.enabled) spawn();
}

void ApiServer::renew() {
  const TimePoint now = MonotonicClock::now();
  renew_until_ = now + kRenewLimit;
  quiet_looks_ = 0;
  renew_timer_.set(now + kRenewLook);
}

void ApiServer::look_whether_answered() {
  const TimePoint now = MonotonicClock::now();
  quiet_looks_ = is_asked_() ? 0 : quiet_looks_ + 1;
  if (quiet_looks_ < kQuietLooks && now < renew_until_) return renew_timer_.set(now + kRenewLook);
  begin_anew();
}

void ApiServer::begin_anew() {
  const bool same_network = network_ == config_.dds && domain_ == config_.host.dds_domain;
  if (!same_network) {  // where another host may have the name
    name_since_ns_ = 0;
    name_held_ = false;
  }
  delay_ = name_delay_ = Duration::zero();
  timer_.cancel();
  if (!process_) return start();
  spdlog::info("API server: ends, because its configuration has changed");
  renewing_ = true;
  beat_timer_.cancel();
  signal(*process_, SIGTERM);
  timer_.set(MonotonicClock::now() + kEndLimit);
}

void ApiServer::signal(const ChildProcess& process, int signal) const {
  const auto sent = user_ ? signal_process_of(*user_, process, signal) : signal_process(process, signal);
  if (!sent) spdlog::error("API server: {}", sent.error().describe());
}

std::vector<std::string> ApiServer::arguments() const {
  const HostConfig& host = config_.host;
  std::vector<std::string> arguments = {program_,
                                        "--host",
                                        host.name,
                                        "--domain",
                                        fmt::format("{}", host.dds_domain),
                                        "--pool",
                                        host.pool,
                                        "--run-directory",
                                        host.run_directory,
                                        "--interface",
                                        config_.dds.interface,
                                        "--blocks-base",
                                        config_.blocks.base,
                                        "--host-number",
                                        fmt::format("{}", config_.blocks.host_number),
                                        "--audit-folder",
                                        audit_folder(host),
                                        "--applications-folder",
                                        applications_folder(host.state_directory, host.name),
                                        "--application-limit",
                                        fmt::format("{}", host.application_limit_mib),
                                        "--read-variables",
                                        host.read_variables,
                                        "--write-variables",
                                        host.write_variables,
                                        "--log-level",
                                        host.log_level,
                                        "--parent",
                                        fmt::format("{}", ::getpid())};
  for (const std::string& label : host.labels) {
    arguments.emplace_back("--label");
    arguments.push_back(label);
  }
  for (const std::string& peer : config_.dds.peers) {
    arguments.emplace_back("--peer");
    arguments.push_back(peer);
  }
  if (!config_.dds.identity.empty()) {
    arguments.emplace_back("--identity");
    arguments.push_back(config_.dds.identity);
  }
  if (!config_.dds.user.empty()) {
    arguments.emplace_back("--user");
    arguments.push_back(config_.dds.user);
  }
  for (const uid_t user : users_of_instances()) {
    arguments.emplace_back("--instance-user");
    arguments.push_back(fmt::format("{}", user));
  }
  if (config_.dds.allow_unsecured) arguments.emplace_back("--allow-unsecured");
  if (!config_.dds.multicast) arguments.emplace_back("--no-multicast");
  if (beats_) {
    arguments.emplace_back("--beat-fd");
    arguments.push_back(fmt::format("{}", kChildReportFd));
  }
  arguments.emplace_back("--name-since");
  arguments.push_back(fmt::format("{}", name_since_ns_));
  if (name_held_) arguments.emplace_back("--name-held");
  if (name_delay_ != Duration::zero()) arguments.emplace_back("--name-refused");
  return arguments;
}

void ApiServer::spawn() {
  network_ = config_.dds;
  domain_ = config_.host.dds_domain;
  const auto user = user_number(config_.dds.user);
  user_ = !config_.dds.user.empty() && user ? std::optional(*user) : std::nullopt;
  give_ledger();
  spawned_ = MonotonicClock::now();
  if (name_since_ns_ == 0) name_since_ns_ = unix_time_ns();
  beats_.reset(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  auto process = spawn_process({.arguments = arguments(), .report_fd = beats_.get()});
  if (process) {
    auto watch = reactor_.watch(process->pidfd.get(), EPOLLIN, [this](std::uint32_t) { ended(); });
    if (watch) {
      process_ = std::move(*process);
      exit_watch_ = std::move(*watch);
      spdlog::info("API server: process {}", process_->pid);
      if (name_delay_ != Duration::zero()) timer_.set(spawned_ + kNameAsked);
      beats_counted_ = 0;
      heartbeat_ = HeartbeatWatch(kApiStart);
      if (beats_) look_at_beats();
      return;
    }
    signal(*process, SIGKILL);
    spdlog::error("API server: {}", watch.error().describe());
  } else {
    spdlog::error("API server: {}", process.error().describe());
  }
  timer_.set(MonotonicClock::now() + kApiRestartDelayMax);
}

// Of a user that is none the server says so itself.
void ApiServer::give_ledger() const {
  if (!user_) return hand_over_ledger(config_.host.pool, std::nullopt);
  if (const auto account = find_user(config_.dds.user)) hand_over_ledger(config_.host.pool, *account);
}

void ApiServer::ended() {
  const ExitStatus status = reap_process(*process_);
  exit_watch_.reset();
  process_.reset();
  timer_.cancel();
  beat_timer_.cancel();
  if (shut_down_) return std::exchange(shut_down_, nullptr)();
  if (std::exchange(renewing_, false)) return start();
  const TimePoint now = MonotonicClock::now();
  if (status.exited_with(kExitNameTaken)) return name_is_taken(now);
  const bool served = has_served();
  name_held_ = name_held_ || served;
  if (now - spawned_ >= kApiSettled) delay_ = Duration::zero();
  if (served) delay_ = std::min(delay_, kApiServedDelay);
  spdlog::warn("API server: {}; starts again after {} ms", status.describe(),
               std::chrono::duration_cast<std::chrono::milliseconds>(delay_).count());
  timer_.set(now + delay_);
  delay_ = std::clamp(2 * delay_, kApiRestartDelay, kApiRestartDelayMax);
}

void ApiServer::name_is_taken(TimePoint now) {
  name_since_ns_ = 0;
  name_held_ = false;
  name_delay_ = std::clamp(2 * name_delay_, kNameDelay, kNameDelayMax);
  spdlog::error("API server: another host has the name '{}'; asks for it again after {} s", config_.host.name,
                std::chrono::duration_cast<std::chrono::seconds>(name_delay_).count());
  notify_service_manager(
      fmt::format("STATUS=not served over DDS: another host has the name '{}'", config_.host.name));
  timer_.set(now + name_delay_);
}

void ApiServer::on_timer() {
  if (!shut_down_ && !renewing_ && process_) {
    if (beats_ && !has_served()) return timer_.set(MonotonicClock::now() + kNameAsked);  // it still asks
    spdlog::info("API server: the name '{}' is this host's now", config_.host.name);
    notify_service_manager("STATUS=");
    name_delay_ = Duration::zero();
    return;
  }
  if (!shut_down_ && !renewing_) return start();
  spdlog::warn("API server: does not end; it is killed");
  if (process_) signal(*process_, SIGKILL);
}

bool ApiServer::beats_since() const {
  std::uint64_t more = 0;
  return ::read(beats_.get(), &more, sizeof more) == sizeof more;
}

bool ApiServer::has_served() const {
  return beats_counted_ > 0 || beats_since();
}

void ApiServer::look_at_beats() {
  const bool beats = beats_since();
  if (beats && beats_counted_++ == 0) heartbeat_ = HeartbeatWatch(kApiSilence);
  const TimePoint now = MonotonicClock::now();
  heartbeat_.look(now, beats_counted_);
  if (!heartbeat_.silent()) return beat_timer_.set(now + HeartbeatWatch::kLongestGap);
  spdlog::error("API server: {}; it is killed", beats_counted_ == 0 ? "does not come up" : "stands still");
  signal(*process_, SIGKILL);
}

void ApiServer::shut_down(std::function<void()> done) {
  timer_.cancel();
  beat_timer_.cancel();
  renew_timer_.cancel();
  if (!process_) return done();
  shut_down_ = std::move(done);
  signal(*process_, SIGTERM);
  timer_.set(MonotonicClock::now() + kEndLimit);
}

}  // namespace plchost
