#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/control/host_finding.hpp"
#include "manager/config/manager_config.hpp"
#include "manager/host_check/host_files.hpp"

namespace plchost {

/// The facts that the checks look at.
struct CheckedHost {
  struct Instance {
    std::string name;
    int core = -1;
    std::uint64_t memory_max = 0;  ///< bytes; 0: no limit
    std::uint64_t pids_max = 0;    ///< 0: no limit
    int pid = 0;                   ///< of its process; 0: it has none
    std::string group = {};        ///< in the folder of groups
  };
  /// The control groups of the instances.
  struct Groups {
    std::string folder;
    std::string problem = "they were not looked for";          ///< why there are none; empty: there are
    std::vector<std::pair<std::string, std::string>> missing;  ///< controllers, and why
  };
  HostFiles files;
  std::vector<Instance> instances;
  Groups groups = {};
  /// Tries SCHED_FIFO in this process: 0, or the error number.
  std::function<int()> try_fifo;
};

/// One check: a pure function of the host. The finding's id is filled in from here.
struct HostCheck {
  std::string_view id;
  HostFinding (*look)(const CheckedHost& host);
};
[[nodiscard]] std::span<const HostCheck> host_checks() noexcept;

/// All checks, in their order. Reads some hundred small files, waits for nothing.
[[nodiscard]] std::vector<HostFinding> check_host(const CheckedHost& host);

/// The host that this process runs on, with the instances of the configuration.
[[nodiscard]] CheckedHost this_host(const ManagerConfig& config);

/// Warnings and problems into the log, one line each; nothing if there are none.
void log_findings(std::span<const HostFinding> findings);

}  // namespace plchost
