#pragma once

#include <cstddef>
#include <expected>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "manager/api_server.hpp"
#include "manager/config/load_config.hpp"
#include "manager/config/manager_config.hpp"
#include "manager/control/command_server.hpp"
#include "manager/control/config_reload.hpp"
#include "manager/host_check/host_check.hpp"
#include "manager/host_check/host_check_handler.hpp"
#include "manager/store/exception_keeper.hpp"
#include "manager/store/wish_folder.hpp"
#include "manager/store/wish_store.hpp"
#include "manager/supervisor/instance_files.hpp"
#include "manager/supervisor/process_host.hpp"
#include "manager/supervisor/supervisor.hpp"
#include "manager/system/control_groups.hpp"
#include "manager/system/disk_thread.hpp"
#include "manager/system/reactor.hpp"
#include "manager/system/service_manager.hpp"
#include "shm/files/lock_file.hpp"
#include "shm/pages/host_page.hpp"
#include "shm/pages/transition_ring.hpp"
#include "shm/pool/object_pool.hpp"

namespace plchost {

/// Everything put together: one host, one run directory, one pool, one thread.
class Manager : private InstanceObserver {
 public:
  struct Options {
    std::string file;      ///< of the configuration, absolute
    std::string folder;    ///< that relative application paths in commands start in
    std::string programs;  ///< the folder of plc-instance and plchost-dds
    std::vector<std::string_view> schedulers;
    /// The configuration as it is in the file now.
    std::function<std::expected<ManagerConfig, ConfigErrors>()> read;
  };

  /// Takes the run directory, makes pool, page and control socket. already_exists: another manager has it,
  /// or keeps its wishes in the same folder.
  [[nodiscard]] static Result<std::unique_ptr<Manager>> create(const ManagerConfig& config, Options options);
  Manager(const Manager&) = delete;
  Manager& operator=(const Manager&) = delete;

  /// Until SIGTERM or SIGINT, and then until everything has ended and is removed.
  [[nodiscard]] Result<void> run();

 private:
  Manager(const ManagerConfig& config, Options options, LockFile lock, std::unique_ptr<Reactor> reactor);
  [[nodiscard]] Result<void> set_up();
  [[nodiscard]] Result<void> lock_wishes();
  [[nodiscard]] Result<void> check_state_folders();
  [[nodiscard]] bool server_has_own_user() const noexcept;
  [[nodiscard]] Result<void> find_instance_user();
  void share_folders();
  void share_with_server();
  [[nodiscard]] Result<TransitionRing> open_transitions(const std::string& instance) const;
  void prepare_files(const std::string& instance);
  void make_supervisor();
  [[nodiscard]] Supervisor::HostedInstance make_host(const InstanceConfig& instance);
  [[nodiscard]] ProcessHost::Share share_of(const std::string& instance) const;
  [[nodiscard]] CheckedHost checked_host() const;
  void remove_groups();
  void adopt_removed();
  [[nodiscard]] Result<std::vector<std::string>> reload();
  void take_over_host(const ManagerConfig& now, std::vector<std::string>& lines);
  void use_housekeeping_cores(std::vector<std::string>& lines) const;
  void use_pool_rights(std::vector<std::string>& lines) const;
  void remove_pages(const std::string& instance) const;
  void remove_kept_settings(const std::string& instance) const;
  void write_host();
  void changed(std::size_t place, const InstanceStatus& status) override;
  void transition(const InstanceStatus& status, InstanceState from, InstanceState to,
                  std::string_view reason) override;
  void stepped(const InstanceStatus& status, InstancePhase from, InstancePhase to) override;
  void gone(std::size_t place, const InstanceConfig& config) override;
  void end(int signal);
  void shut_down();
  void leave();
  void clean_up();
  void tick();
  void look_after_pool();
  void keep_exceptions(TimePoint now);
  void when_kept(std::function<void()> done);
  void await_exceptions();
  void restore_latency();

  ManagerConfig config_;
  Options options_;
  // From here on in the order of making; destroyed in the reverse one.
  LockFile lock_;
  DiskThread state_disk_;   // of [host] state_directory
  DiskThread config_disk_;  // of the configuration
  WishFolderLock wishes_lock_;
  std::unique_ptr<Reactor> reactor_;
  InstanceUser instance_user_;
  ControlGroups groups_;
  bool can_lower_oom_scores_ = false;
  std::optional<ObjectPool> pool_;
  std::optional<HostPageWriter> page_;
  HostStatus host_status_;
  std::map<std::string, TransitionRing, std::less<>> transitions_;  // by instance
  WishWriter wish_writer_;
  ExceptionKeeper exceptions_;
  Reactor::Timer exceptions_wait_;
  TimePoint exceptions_limit_;
  bool looked_again_ = false;  // at the end, behind the orders that were under way
  std::function<void()> all_kept_;
  std::map<std::string, WishStore*> wishes_;  // by instance; the supervisor's
  std::vector<InstanceConfig> gone_;          // removed and ended; retain variables not yet saved
  std::unique_ptr<Supervisor> supervisor_;
  std::unique_ptr<HostCheckHandler> host_check_;
  std::unique_ptr<ConfigReload> reload_;
  std::unique_ptr<CommandServer> command_server_;
  ApiServer api_server_;
  Reactor::Timer tick_;
  ServiceWatchdog service_watchdog_;
  unsigned ticks_ = 0;
  bool pool_lost_ = false;
  bool latency_due_ = true;  // an instance may have ended without putting back what it held
  bool ending_ = false;
};

}  // namespace plchost
