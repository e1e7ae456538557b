#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
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
  /// Makes the host of one instance, and is told where its events go.
  struct HostedInstance {
    std::unique_ptr<InstanceHost> host;
    std::unique_ptr<ApplicationKeeper> applications;
    std::unique_ptr<WishKeeper> wishes;
    std::function<void(InstanceEvents&)> connect;
  };
  using HostFactory = std::function<HostedInstance(const InstanceConfig&)>;

  Supervisor(const std::vector<InstanceConfig>& instances, ManagedInstance::Surroundings surroundings,
             HostFactory make_host);

  /// Before start(): takes over a process that an earlier manager has left and whose instance is not in the
  /// configuration. False: there is none.
  bool adopt_removed(const std::string& name);
  /// Takes over what is there, then goes on with the others as an earlier manager left them, in order.
  void start();
  void handle(const ControlRequest& request, ControlReplyFunction reply) override;
  /// full: with those that were removed and still run there would be more than kMaxInstances.
  [[nodiscard]] Result<void> check_room(const std::vector<InstanceConfig>& now) const;
  /// Takes over these instances in place of those before; see managed_instance.hpp. One line for each change.
  std::vector<std::string> reload(const std::vector<InstanceConfig>& now);
  /// Whether the host allows debug builds is another one now: a line for each instance that runs one.
  [[nodiscard]] std::vector<std::string> tell_debug_builds() const;
  /// The log level of the host is another one now: all instances that are up take it over.
  void use_log_level();
  /// Ends all instances in reverse order; calls `done` when none is left, possibly at once.
  void shut_down(std::function<void()> done);
  /// Calls `done` when the wishes of all instances are on the disk, or cannot be; possibly at once.
  void when_kept(const std::function<void()>& done);
  /// To be called periodically: see ManagedInstance::refresh.
  void refresh();

  /// Of all instances, those that were removed included.
  [[nodiscard]] std::vector<InstanceConfig> configs() const;
  [[nodiscard]] ManagedInstance& instance(std::size_t index) { return *units_[index]->instance; }
  /// As the observer is told it.
  [[nodiscard]] std::size_t place(std::size_t index) const { return units_[index]->place; }
  [[nodiscard]] std::size_t size() const noexcept { return units_.size(); }

 private:
  struct Unit {
    std::unique_ptr<InstanceHost> host;
    std::unique_ptr<ApplicationKeeper> applications;
    std::unique_ptr<WishKeeper> wishes;
    std::unique_ptr<ManagedInstance> instance;
    std::size_t place = 0;
    std::vector<Unit*> after;   // start first
    std::vector<Unit*> before;  // end first
    bool ending = false;
    std::optional<TimePoint> gone_since;
  };
  Unit& add(const InstanceConfig& config);
  [[nodiscard]] std::unique_ptr<Unit> make_unit(const InstanceConfig& config, std::size_t place);
  [[nodiscard]] Unit* find(std::string_view name) const;
  [[nodiscard]] std::size_t free_place() const;
  void link();
  void forget_gone();
  void tell_changes(Unit& unit, const InstanceConfig& now, std::vector<std::string>& lines);
  void advance();
  void advance_start(Unit& unit);
  void advance_end();
  [[nodiscard]] std::string names() const;

  const ManagedInstance::Surroundings surroundings_;
  HostFactory make_host_;
  std::vector<std::unique_ptr<Unit>> units_;
  std::function<void()> shut_down_;
  bool advancing_ = false;
  bool changed_again_ = false;
};

/// So long an instance that was removed and has ended is still told, so that clients learn how it ended.
inline constexpr Duration kGoneShown = std::chrono::milliseconds(500);

}  // namespace plchost
