#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "api/control/control_handler.hpp"
#include "manager/config/manager_config.hpp"
#include "manager/supervisor/instance_host.hpp"
#include "manager/supervisor/managed_instance.hpp"

namespace plchost {

/// All instances: which one a command is for, and in which order they start and end. A later instance of
/// `after` starts when the earlier ones are up, and ends before them.
class Supervisor : public ControlHandler {
 public:
  struct Surroundings {
    std::string folder;
    std::vector<std::string_view> schedulers;
    std::function<TimePoint()> now;
    /// Instance number `index` has changed.
    std::function<void(std::size_t index, const InstanceStatus& status)> publish;
    /// The process of instance number `index` has gone from one state to another. May be empty.
    std::function<void(std::size_t index, InstanceState from, InstanceState to, std::string_view reason)>
        transition = {};
  };
  /// Makes the host of one instance, and is told where its events go.
  struct HostedInstance {
    std::unique_ptr<InstanceHost> host;
    std::unique_ptr<ApplicationKeeper> applications;
    std::unique_ptr<WishKeeper> wishes;
    std::function<void(InstanceEvents&)> connect;
  };
  using HostFactory = std::function<HostedInstance(const InstanceConfig&)>;

  /// `config` outlives it.
  Supervisor(const ManagerConfig& config, Surroundings surroundings, const HostFactory& make_host);

  /// Takes over what is there, then goes on with the others as an earlier manager left them, in order.
  void start();
  void handle(const ControlRequest& request, ControlReplyFunction reply) override;
  /// Ends all instances in reverse order; calls `done` when none is left, possibly at once.
  void shut_down(std::function<void()> done);
  /// Calls `done` when what all instances are to be is on the disk, or cannot be; possibly at once.
  void when_kept(const std::function<void()>& done);
  /// To be called now and then: see ManagedInstance::refresh.
  void refresh();

  [[nodiscard]] ManagedInstance& instance(std::size_t index) { return *units_[index].instance; }
  [[nodiscard]] std::size_t size() const noexcept { return units_.size(); }

 private:
  struct Unit {
    std::unique_ptr<InstanceHost> host;
    std::unique_ptr<ApplicationKeeper> applications;
    std::unique_ptr<WishKeeper> wishes;
    std::unique_ptr<ManagedInstance> instance;
    std::vector<std::size_t> after;   // start first
    std::vector<std::size_t> before;  // end first
    bool ending = false;
  };
  void changed(std::size_t index);
  void advance();
  void advance_start(Unit& unit);
  void advance_end();
  [[nodiscard]] std::string names() const;

  Surroundings surroundings_;
  std::vector<Unit> units_;
  std::function<void()> shut_down_;
  bool advancing_ = false;
  bool changed_again_ = false;
};

}  // namespace plchost
