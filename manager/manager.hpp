#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "manager/api_server.hpp"
#include "manager/config/manager_config.hpp"
#include "manager/control/command_server.hpp"
#include "manager/host_check/host_check_handler.hpp"
#include "manager/store/wish_store.hpp"
#include "manager/supervisor/supervisor.hpp"
#include "manager/system/reactor.hpp"
#include "shm/base/lock_file.hpp"
#include "shm/pool/host_page.hpp"
#include "shm/pool/object_pool.hpp"
#include "shm/pool/transition_ring.hpp"

namespace plchost {

/// Everything put together: one host, one run directory, one pool, one thread.
class Manager {
 public:
  struct Options {
    std::string folder;    ///< that relative application paths in commands start in
    std::string programs;  ///< the folder of plc-instance and plchost-dds
    std::vector<std::string_view> schedulers;
  };

  /// Takes the run directory, makes pool, page and control socket. already_exists: another manager has it.
  [[nodiscard]] static Result<std::unique_ptr<Manager>> create(const ManagerConfig& config, Options options);
  Manager(const Manager&) = delete;
  Manager& operator=(const Manager&) = delete;

  /// Until SIGTERM or SIGINT, and then until everything has ended and is removed.
  [[nodiscard]] Result<void> run();

 private:
  Manager(const ManagerConfig& config, Options options, LockFile lock, std::unique_ptr<Reactor> reactor);
  [[nodiscard]] Result<void> set_up();
  void make_supervisor();
  void write_host();
  void shut_down();
  void clean_up();
  void tick();
  void look_after_pool();
  void restore_latency();

  const ManagerConfig& config_;
  Options options_;
  // From here on in the order of making; destroyed in the reverse one.
  LockFile lock_;
  std::unique_ptr<Reactor> reactor_;
  std::optional<ObjectPool> pool_;
  std::optional<HostPageWriter> page_;
  std::vector<TransitionRing> transitions_;  // in the order of the instances
  WishWriter wish_writer_;
  std::vector<WishStore*> wishes_;  // the supervisor's
  std::unique_ptr<Supervisor> supervisor_;
  std::unique_ptr<HostCheckHandler> host_check_;
  std::unique_ptr<CommandServer> command_server_;
  ApiServer api_server_;
  Reactor::Timer tick_;
  unsigned ticks_ = 0;
  bool pool_lost_ = false;
  bool latency_due_ = true;  // an instance may have ended without putting back what it held
  bool ending_ = false;
};

}  // namespace plchost
