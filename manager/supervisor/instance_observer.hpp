#pragma once

#include <cstddef>
#include <string_view>

#include "manager/config/manager_config.hpp"
#include "manager/supervisor/instance_phase.hpp"
#include "shm/pages/host_page.hpp"

namespace plchost {

/// Is told what happens to the instances: the Manager, by each ManagedInstance and by their Supervisor. All
/// calls come on the Reactor's thread.
class InstanceObserver {
 public:
  virtual ~InstanceObserver() = default;
  /// The instance at `place` shows `status` now. It keeps its place as long as there is one of that name.
  virtual void changed(std::size_t place, const InstanceStatus& status) = 0;
  /// The process has gone from one state to another. The process itself tells what only follows the state of
  /// its application.
  virtual void transition(const InstanceStatus& status, InstanceState from, InstanceState to,
                          std::string_view reason) = 0;
  /// The instance has taken a step from one phase to another, or stays in its phase, and shows `status` now.
  /// See wrong_step().
  virtual void stepped(const InstanceStatus& status, InstancePhase from, InstancePhase to) = 0;
  /// There is no instance at `place` any more; the last one had this configuration.
  virtual void gone(std::size_t place, const InstanceConfig& config) = 0;
};

}  // namespace plchost
