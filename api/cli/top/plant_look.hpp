#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <control.h>

#include "api/client/control_client.hpp"

namespace plchost {

/// The status of one host at a moment. A part that has not come within the time of a look is that of the look
/// before.
struct HostLook {
  HostView host;
  std::vector<plc_InstanceStatus> instances;
  std::vector<plc_TaskStatus> tasks;
  std::vector<plc_LossStatus> losses;
  std::vector<plc_ExceptionStatus> exceptions;
};

/// Null: it was not seen.
[[nodiscard]] const HostLook* find_host(const std::vector<HostLook>& hosts, std::string_view name) noexcept;

/// The statistics of the tasks of one instance.
struct InstanceStatistics {
  std::string host;
  std::string instance;
  std::vector<StatisticsReport> tasks;
};

/// Looks at hosts again and again. One thread, that of its client.
class PlantLook {
 public:
  explicit PlantLook(ControlClient& client) noexcept : client_(client) {}

  /// At these. Waits no longer than until `deadline`.
  void take(std::vector<HostView> hosts, TimePoint deadline);
  [[nodiscard]] const std::vector<HostLook>& hosts() const noexcept { return hosts_; }
  /// Of that instance's tasks, as they came last. The first call asks the hosts for statistics.
  [[nodiscard]] InstanceStatistics statistics(const std::string& host, const std::string& instance);

 private:
  ControlClient& client_;
  std::vector<HostLook> hosts_;
};

}  // namespace plchost
