#include "manager/manager.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "api/control/application_versions.hpp"
#include "api/control/control_handler.hpp"
#include "instances/launch/core_latency.hpp"
#include "manager/config/accounts.hpp"
#include "manager/host_check/host_check.hpp"
#include "manager/pool_rights.hpp"
#include "manager/retain_memories.hpp"
#include "manager/store/exception_folder.hpp"
#include "manager/store/store_process.hpp"
#include "manager/supervisor/instance_files.hpp"
#include "manager/system/child_process.hpp"
#include "manager/system/oom_score.hpp"
#include "manager/system/service_manager.hpp"
#include "shm/base/names.hpp"
#include "shm/base/time.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/own_folder.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/log/log.hpp"
#include "shm/pages/foreign_files.hpp"
#include "shm/pages/host_page.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/pages/reference_clock.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

namespace {

// How often instances are asked what they say of themselves, by reading their pages.
constexpr Duration kTick = std::chrono::milliseconds(50);
constexpr unsigned kTicksPerTidying = 20;  // of the pool

static_assert(kMinPoolObjects == kMinObjects && kMaxPoolObjects == kMaxObjects,
              "[host] pool_objects allows what a pool allows");

Result<void> make_run_directory(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) return failure(ErrorCode::system, "cannot create the run directory " + path, error.value());
  // Locks, sockets and records in it are believed.
  PLCHOST_TRY(in_step("[host] run_directory", check_own_folder(path)));
  return {};
}

// In the folder nobody has a file but this user, root, and instances with a user of their own.
Result<LockFile> take_lock(const std::string& path, const std::string& instance_user) {
  auto lock = LockFile::take(path);
  if (lock || lock.error().code != ErrorCode::refused) return lock;
  put_folder_aside(path);
  // An instance keeps no manager from its start. A manager of another user does.
  const auto of_instances = user_number(instance_user);
  const auto holder = user_that_holds(path);
  if (holder && !(of_instances && *of_instances == *holder))
    return failure(ErrorCode::already_exists, fmt::format("a process of user {} holds {}", *holder, path));
  spdlog::warn("{}; it is removed and not used", lock.error().describe());
  PLCHOST_TRY(take_away(path));
  return LockFile::take(path);
}

// The lock is by run directory; two managers with one pool would overwrite each other's pages all the same.
Result<void> check_pool_is_free(const std::string& pool) {
  const auto page = HostPageReader::open(pool);
  if (!page) return {};
  constexpr Duration kPatience = std::chrono::milliseconds(100);
  constexpr Duration kAgain = std::chrono::milliseconds(1);
  const TimePoint deadline = MonotonicClock::now() + kPatience;
  // Its own part only: those of instances may be damaged, or within a write.
  auto host = page->host();
  for (; !host && MonotonicClock::now() < deadline; host = page->host()) std::this_thread::sleep_for(kAgain);
  if (!host) return {};  // its writer ended while it wrote
  if (host->manager_pid <= 0 || host->manager_pid == ::getpid()) return {};
  const auto program = [](const std::string& process) {
    std::error_code error;
    return std::filesystem::read_symlink(fmt::format("/proc/{}/exe", process), error).filename();
  };
  const auto other = program(fmt::format("{}", host->manager_pid));
  if (other.empty() || other != program("self")) return {};
  return failure(
      ErrorCode::already_exists,
      fmt::format("pool '{}' is in use by another manager, process {}; give [host] pool another name", pool,
                  host->manager_pid));
}

// "line1.sock" belongs to line1.
bool is_ours(const std::vector<InstanceConfig>& instances, const std::filesystem::path& file) {
  return std::ranges::find(instances, file.stem().string(), &InstanceConfig::name) != instances.end();
}

// Processes that no manager has started: not ours to stop.
void warn_of_strangers(const std::string& run_directory, const std::vector<InstanceConfig>& instances) {
  std::error_code error;
  for (std::filesystem::directory_iterator at(run_directory, error), end; !error && at != end;
       at.increment(error)) {
    const bool socket = at->path().extension() == ".sock" && at->path().stem() != "manager";
    if (socket && !is_ours(instances, at->path())) {
      spdlog::warn("{} belongs to no configured instance; its process, if there is one, is left alone",
                   at->path().string());
    }
  }
}

}  // namespace

Manager::Manager(const ManagerConfig& config, Options options, LockFile lock,
                 std::unique_ptr<Reactor> reactor)
    : config_(config),
      options_(std::move(options)),
      lock_(std::move(lock)),
      reactor_(std::move(reactor)),
      wish_writer_(*reactor_, "/proc/self/exe"),
      // NOLINTNEXTLINE(bugprone-throw-keyword-missing): a member, of which none is thrown
      exceptions_(wish_writer_, state_disk_,
                  {.folder = exceptions_folder(config_.host.state_directory, config_.host.name),
                   .run_directory = config_.host.run_directory}),
      exceptions_wait_(*reactor_, [this] { await_exceptions(); }),
      api_server_(*reactor_, config_, options_.programs + "/plchost-dds",
                  [this] { return command_server_ && command_server_->waits_for_answers(); }),
      tick_(*reactor_, [this] { tick(); }) {}

Result<std::unique_ptr<Manager>> Manager::create(const ManagerConfig& config, Options options) {
  PLCHOST_TRY(make_run_directory(config.host.run_directory));
  auto lock = take_lock(config.host.run_directory + "/manager.lock", config.host.instance_user);
  if (!lock && lock.error().code == ErrorCode::already_exists) {
    return failure_in("another manager runs with this run directory", lock.error());
  }
  PLCHOST_TRY(lock);
  PLCHOST_TRY_ASSIGN(auto reactor, Reactor::create());
  std::unique_ptr<Manager> manager(new Manager(  // NOLINT: the constructor is private
      config, std::move(options), std::move(*lock), std::move(reactor)));
  PLCHOST_TRY(manager->set_up());
  return manager;
}

// Without the lock the manager runs all the same: a disk that fails is no reason to stop a plant.
Result<void> Manager::lock_wishes() {
  auto locked =
      wishes_lock_.take(state_disk_, wishes_folder(config_.host.state_directory, config_.host.name));
  if (locked || locked.error().code == ErrorCode::already_exists) return locked;
  spdlog::error("[host] state_directory: the manager cannot see whether another one uses it: {}",
                locked.error().describe());
  return {};
}

Result<void> Manager::set_up() {
  const HostConfig& host = config_.host;
  if (auto free = check_pool_is_free(host.pool); !free) return free;
  PLCHOST_TRY(find_instance_user());
  PLCHOST_TRY(check_state_folders());
  if (auto alone = lock_wishes(); !alone) return alone;
  PLCHOST_TRY(check_state_folders());  // one that somebody else has made meanwhile
  can_lower_oom_scores_ = take_oom_score(kInstanceOomScore, kManagerOomScore);
  groups_ = ControlGroups::find(host.instance_groups);
  // Children inherit this: instances then bind themselves to their own cores.
  if (auto bound = bind_process_to_cores(0, host.housekeeping_cores); !bound) {
    spdlog::warn("cannot bind the manager to housekeeping_cores: {}", bound.error().describe());
  }
  PLCHOST_TRY_ASSIGN(const auto rights, pool_rights(host));
  const auto server = user_number(config_.dds.user);
  clear_names(host.pool, rights, server_has_own_user() && server ? std::optional(*server) : std::nullopt);
  protect_managers_files(host.pool);
  share_with_server();
  share_folders();  // last: folders that instances may not write are there by now
  if (auto ours = check_pool_owner(host.pool, rights); !ours) return ours;
  PLCHOST_TRY_ASSIGN(auto pool,
                     ObjectPool::create(host.pool, {.max_objects = host.pool_objects,
                                                    .rights = rights,
                                                    .across_containers = host.pool_across_containers}));
  if (auto renewed = renew_pool_rights(host.pool, rights); !renewed) {
    spdlog::warn("{}", renewed.error().describe());
  }
  warn_of_another_kind(pool, host);
  pool_ = std::move(pool);
  PLCHOST_TRY_ASSIGN(page_, HostPageWriter::create(host.pool));
  auto signals = reactor_->watch_signals({SIGTERM, SIGINT, SIGHUP}, [this](int signal) {
    if (signal != SIGHUP) return end(signal);
    reload_->reload_by_signal();
  });
  if (!signals) return signals;
  for (const InstanceConfig& instance : config_.instances) {
    PLCHOST_TRY_ASSIGN(auto ring, open_transitions(instance.name));
    transitions_.emplace(instance.name, std::move(ring));
  }
  make_supervisor();
  write_host();
  host_check_ =
      std::make_unique<HostCheckHandler>(*supervisor_, [this] { return check_host(checked_host()); });
  reload_ = std::make_unique<ConfigReload>(
      *reactor_,
      ConfigReload::Settings{
          .file = options_.file, .program = "/proc/self/exe", .programs = options_.programs},
      *host_check_, [this] { return reload(); });
  put_folder_aside(manager_socket_path(host.run_directory));
  PLCHOST_TRY_ASSIGN(command_server_,
                     CommandServer::open(*reactor_, manager_socket_path(host.run_directory), *reload_));
  return {};
}

Supervisor::HostedInstance Manager::make_host(const InstanceConfig& instance) {
  const HostConfig& own = config_.host;
  exceptions_.restore(instance.name);
  const std::string plc_instance = options_.programs + "/plc-instance";
  const TrialGroup trial_group(groups_, trial_group_name(own.pool, instance.name),
                               [this, name = instance.name] { return share_of(name).limits; });
  auto host = std::make_unique<ProcessHost>(
      *reactor_,
      ProcessHost::Settings{.program = plc_instance,
                            .name = instance.name,
                            .pool = own.pool,
                            .run_directory = own.run_directory,
                            .prepare = [this, name = instance.name] { prepare_files(name); },
                            .withdraw_events = [this, name = instance.name] { pool_->withdraw_events(name); },
                            .groups = &groups_,
                            .share = [this, name = instance.name] { return share_of(name); },
                            .trial_group = trial_group});
  ProcessHost& made = *host;
  auto applications = std::make_unique<StoreProcess>(
      *reactor_, state_disk_,
      StoreProcess::Settings{
          .pool = own.pool,
          .folder = versions_folder(applications_folder(own.state_directory, own.name), instance.name),
          .keep = [&own] { return own.application_versions; },
          .helper = "/proc/self/exe",
          .plc_instance = plc_instance,
          .trial_group = trial_group});
  auto wishes =
      std::make_unique<WishStore>(*reactor_, wish_writer_, state_disk_,
                                  WishStore::Settings{.pool = own.pool,
                                                      .instance = instance.name,
                                                      .folder = wishes_folder(own.state_directory, own.name),
                                                      .run_directory = own.run_directory});
  wishes_[instance.name] = wishes.get();
  return Supervisor::HostedInstance{
      .host = std::move(host),
      .applications = std::move(applications),
      .wishes = std::move(wishes),
      .connect = [&made](InstanceEvents& events) { made.connect_events(events); }};
}

// As the configuration is now.
ProcessHost::Share Manager::share_of(const std::string& instance) const {
  constexpr std::uint64_t kMib = 1U << 20;
  const auto config = std::ranges::find(config_.instances, instance, &InstanceConfig::name);
  if (config == config_.instances.end()) return {};
  ProcessHost::Share share{
      .limits = {.memory_bytes = config->memory_max_mib * kMib, .pids = config->pids_max}, .oom_score = {}};
  // The default is refused where nobody has the right to it, which is no fault of the configuration.
  if (can_lower_oom_scores_ || config->oom_score != kInstanceOomScore) share.oom_score = config->oom_score;
  return share;
}

CheckedHost Manager::checked_host() const {
  CheckedHost host = this_host(config_);
  host.groups = {.folder = groups_.folder(), .problem = groups_.problem(), .missing = {}};
  for (const auto& [controller, why] : groups_.missing()) host.groups.missing.emplace_back(controller, why);
  for (CheckedHost::Instance& instance : host.instances) {
    instance.group = control_group_name(config_.host.pool, instance.name);
    for (std::size_t i = 0; i < supervisor_->size(); ++i) {
      const InstanceStatus& status = supervisor_->instance(i).status();
      // One that is being set up may not have gone into its group yet.
      if (status.name.view() == instance.name && status.state != InstanceState::starting)
        instance.pid = status.pid;
    }
  }
  return host;
}

void Manager::make_supervisor() {
  supervisor_ =
      std::make_unique<Supervisor>(config_.instances,
                                   ManagedInstance::Surroundings{.host = config_.host,
                                                                 .folder = options_.folder,
                                                                 .schedulers = options_.schedulers,
                                                                 .now = [] { return MonotonicClock::now(); },
                                                                 .observer = *this},
                                   [this](const InstanceConfig& instance) { return make_host(instance); });
}

void Manager::write_host() {
  host_status_.name.assign(config_.host.name);
  host_status_.version.assign(PLCHOST_VERSION);
  host_status_.manager_pid = ::getpid();
  host_status_.instance_count = static_cast<std::uint32_t>(config_.instances.size());
  host_status_.started_unix_ns = unix_time_ns();
  host_status_.schedulers.assign(fmt::format("{}", fmt::join(options_.schedulers, ",")));
  for (std::size_t i = 0; i < supervisor_->size(); ++i) {
    page_->write_instance(static_cast<std::uint32_t>(supervisor_->place(i)),
                          supervisor_->instance(i).status());
  }
  page_->write_host(host_status_);
}

void Manager::transition(const InstanceStatus& status, InstanceState from, InstanceState to,
                         std::string_view reason) {
  const auto ring = transitions_.find(status.name.view());
  if (ring == transitions_.end()) return;
  ring->second.add(TransitionSource::process, std::to_underlying(from), std::to_underlying(to), status.pid,
                   reason);
}

// The process has taken the step already, so its instance is not kept from it.
void Manager::stepped(const InstanceStatus& status, InstancePhase from, InstancePhase to) {
  const std::string wrong = wrong_step(from, to, status.state);
  if (wrong.empty()) return;
  spdlog::error("instance {}: {}; this is a fault of plchostd: report it with its log", status.name.view(),
                wrong);
}

// The instance first: a reader of the number finds it.
void Manager::changed(std::size_t place, const InstanceStatus& status) {
  const auto index = static_cast<std::uint32_t>(place);
  page_->write_instance(index, status);
  latency_due_ = true;
  if (index < host_status_.instance_count) return;
  host_status_.instance_count = index + 1;
  page_->write_host(host_status_);
}

Result<void> Manager::run() {
  spdlog::info("host '{}': {}, pool '{}', run directory {}", config_.host.name,
               count_text(config_.instances.size(), "instance"), config_.host.pool,
               config_.host.run_directory);
  groups_.remove_empty(control_group_name(config_.host.pool, ""));
  groups_.end_all(trial_group_name(config_.host.pool, ""));
  adopt_removed();
  warn_of_strangers(config_.host.run_directory, supervisor_->configs());
  supervisor_->start();
  api_server_.start();
  tick_.set(MonotonicClock::now() + kTick);
  notify_service_manager("READY=1");
  log_findings(check_host(checked_host()));
  return reactor_->run();
}

void Manager::tick() {
  notify_of_the_rest();
  service_watchdog_.feed(MonotonicClock::now());
  supervisor_->refresh();
  if (latency_due_) restore_latency();
  if (++ticks_ % kTicksPerTidying == 0) {
    look_after_pool();
    keep_exceptions(MonotonicClock::now());
  }
  tick_.set(MonotonicClock::now() + kTick);
}

void Manager::look_after_pool() {
  // An instance of a version before may have made a page anew.
  if (server_has_own_user() || instance_user_) give_roots_files(config_.host.pool, ::getegid());
  if (page_->keep()) {
    spdlog::warn("host page of pool '{}': another program has written over it; it is written anew",
                 config_.host.pool);
  }
  for (const auto& [instance, wishes] : wishes_) wishes->look_after_memory();
  (void)groups_.remove_ended();
  const PoolFindings found = pool_->tidy();
  if (!found.lost && found.headers_mended + found.rebuilds + found.lost_objects != 0) {
    spdlog::warn(
        "pool '{}': another program has written over it: header written anew {}, damaged lists made "
        "anew {}, {} lost",
        config_.host.pool, count_text(found.headers_mended, "time"), count_text(found.rebuilds, "time"),
        count_text(found.lost_objects, "object"));
  }
  if (!found.lost || pool_lost_) return;
  pool_lost_ = true;
  spdlog::error(
      "pool '{}': another program has cut its file in {} short; the instances' shared objects are lost: stop "
      "this "
      "manager, which removes it, and start it again",
      config_.host.pool, MemoryFile::kDirectory);
}

// The possessions of instances that are gone, now or before this manager.
void Manager::restore_latency() {
  const auto restored = restore_core_latency(std::string(kSysfs), config_.host.run_directory);
  latency_due_ = !restored && restored.error().code == ErrorCode::busy;
  if (!restored) return;
  for (const std::string& line : *restored) spdlog::info("{}", line);
}

void Manager::end(int signal) {
  if (std::exchange(ending_, true)) return;
  if (signal == SIGTERM) {
    const auto restarted = is_being_restarted();
    if (restarted && *restarted) return leave();
    if (!restarted) {
      spdlog::warn("the manager cannot see whether it is to be started again, and ends its instances: {}",
                   restarted.error().describe());
    }
  }
  shut_down();
}

// As a crash leaves them, but with the operator's last words kept. The next manager adopts them.
void Manager::leave() {
  spdlog::info("ending for a restart: the instances run on");
  reload_->shut_down();
  notify_service_manager("STOPPING=1");
  when_kept([this] { reactor_->stop(); });
}

void Manager::shut_down() {
  spdlog::info("ending: all instances in reverse order of their start");
  reload_->shut_down();
  notify_service_manager("STOPPING=1");
  // The API server last, so that it can still tell the world how the instances end.
  supervisor_->shut_down([this] {
    api_server_.shut_down([this] {
      when_kept([this] {
        clean_up();
        reactor_->stop();
      });
    });
  });
}

void Manager::keep_exceptions(TimePoint now) {
  for (std::size_t i = 0; i < supervisor_->size(); ++i)
    exceptions_.look(supervisor_->instance(i).config().name, now);
}

// The end of this manager: all that the next one is to know is on the disk, or cannot be.
void Manager::when_kept(std::function<void()> done) {
  keep_exceptions(TimePoint::max());  // also those that wait to be tried again
  all_kept_ = std::move(done);
  supervisor_->when_kept([this] {
    exceptions_limit_ = MonotonicClock::now() + kExceptionLimit;
    await_exceptions();
  });
}

// An order that was under way has what there was when it began: so once more behind it.
void Manager::await_exceptions() {
  constexpr Duration kAgain = std::chrono::milliseconds(5);
  const TimePoint now = MonotonicClock::now();
  if (!exceptions_.is_writing() && !std::exchange(looked_again_, true)) keep_exceptions(TimePoint::max());
  if (!exceptions_.is_writing() || now >= exceptions_limit_) return all_kept_();
  exceptions_wait_.set(now + kAgain);
}

// Processes that were ended just now may still be there.
void Manager::remove_groups() {
  constexpr Duration kPatience = std::chrono::milliseconds(500);
  constexpr Duration kAgain = std::chrono::milliseconds(5);
  const TimePoint deadline = MonotonicClock::now() + kPatience;
  while (!groups_.remove_ended() && MonotonicClock::now() < deadline) std::this_thread::sleep_for(kAgain);
}

void Manager::clean_up() {
  restore_latency();
  groups_.end_all(trial_group_name(config_.host.pool, ""));  // of a trial that was under way
  remove_groups();
  for (const auto& [instance, wishes] : wishes_) wishes->end();
  // Also those that were removed from the configuration.
  config_.instances = supervisor_->configs();
  for (const InstanceConfig& instance : config_.instances) remove_pages(instance.name);
  std::ranges::copy_if(gone_, std::back_inserter(config_.instances), [&](const InstanceConfig& instance) {
    return std::ranges::find(config_.instances, instance.name, &InstanceConfig::name) ==
           config_.instances.end();
  });
  // Each file that is named after an instance of ours: its socket, and the state for its next process. Its
  // exceptions outlive the manager: that they are still known tomorrow is what they are kept for.
  std::error_code error;
  for (std::filesystem::directory_iterator at(config_.host.run_directory, error), end; !error && at != end;
       at.increment(error)) {
    const bool kept = at->path().extension() == ".exception";
    if (!kept && is_ours(config_.instances, at->path())) ::unlink(at->path().c_str());
  }
  ::unlink(manager_socket_path(config_.host.run_directory).c_str());
  remove_downloads(config_.host.pool);
  MemoryFile::remove(host_page_name(config_.host.pool));
  // Also if the pool stays: the host may be switched off next.
  const auto unsaved = save_retain_memories(config_, options_.programs + "/plc-instance");
  if (!config_.host.keep_pool) {
    ObjectPool::remove(config_.host.pool);
    remove_pool_memories(config_.host.pool, unsaved);
    MemoryFile::remove(config_.host.pool + ".posts");  // how far each source of remote posts had come
  }
  lock_.remove();
}

}  // namespace plchost
