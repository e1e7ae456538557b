#include "manager/host_check/host_check.hpp"

#include <algorithm>
#include <array>
#include <cerrno>

#include <sched.h>

#include "manager/host_check/checks.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

// From the rights without which nothing works to what is only nice to have.
constexpr std::array kChecks = {
    HostCheck{"real_time_class", &host_check::real_time_class},
    HostCheck{"priority_limit", &host_check::priority_limit},
    HostCheck{"memory_lock", &host_check::memory_lock},
    HostCheck{"allowed_cores", &host_check::allowed_cores},
    HostCheck{"instance_limits", &host_check::instance_limits},
    HostCheck{"preemption", &host_check::preemption},
    HostCheck{"isolated_cores", &host_check::isolated_cores},
    HostCheck{"housekeeping", &host_check::housekeeping},
    HostCheck{"siblings", &host_check::siblings},
    HostCheck{"interrupts", &host_check::interrupts},
    HostCheck{"idle_states", &host_check::idle_states},
    HostCheck{"governor", &host_check::governor},
    HostCheck{"clock_source", &host_check::clock_source},
    HostCheck{"cpu_quota", &host_check::cpu_quota},
    HostCheck{"numa_balancing", &host_check::numa_balancing},
    HostCheck{"throttling", &host_check::throttling},
    HostCheck{"timer_slack", &host_check::timer_slack},
    HostCheck{"timer_migration", &host_check::timer_migration},
    HostCheck{"tick", &host_check::tick},
    HostCheck{"rcu_callbacks", &host_check::rcu_callbacks},
    HostCheck{"workqueues", &host_check::workqueues},
    HostCheck{"default_interrupts", &host_check::default_interrupts},
    HostCheck{"watchdog", &host_check::watchdog},
    HostCheck{"shared_cores", &host_check::shared_cores},
    HostCheck{"swap", &host_check::swap},
    HostCheck{"huge_pages", &host_check::huge_pages},
    HostCheck{"compaction", &host_check::compaction},
    HostCheck{"machine", &host_check::machine},
    HostCheck{"container", &host_check::container},
};
static_assert(kChecks.size() <= kMaxFindings);

// The calling thread is SCHED_FIFO for a moment, and then as before. The instances get the same: they have
// the same rights, and only version 1 of control groups, which they inherit, has real-time run time.
int try_fifo() {
  const int policy = ::sched_getscheduler(0);
  sched_param before{};
  if (policy < 0 || ::sched_getparam(0, &before) != 0) return errno;
  const sched_param lowest{.sched_priority = 1};
  if (::sched_setscheduler(0, SCHED_FIFO, &lowest) != 0) return errno;
  return ::sched_setscheduler(0, policy, &before) == 0 ? 0 : errno;
}

}  // namespace

std::span<const HostCheck> host_checks() noexcept {
  return kChecks;
}

std::vector<HostFinding> check_host(const CheckedHost& host) {
  std::vector<HostFinding> findings;
  findings.reserve(kChecks.size());
  for (const HostCheck& check : kChecks) {
    findings.push_back(check.look(host));
    findings.back().id = check.id;
  }
  return findings;
}

CheckedHost this_host(const ManagerConfig& config) {
  constexpr std::uint64_t kMib = 1U << 20;
  CheckedHost host{.files = HostFiles(), .instances = {}, .try_fifo = try_fifo};
  for (const InstanceConfig& instance : config.instances)
    host.instances.push_back({.name = instance.name,
                              .core = instance.core,
                              .memory_max = instance.memory_max_mib * kMib,
                              .pids_max = instance.pids_max});
  return host;
}

void log_findings(std::span<const HostFinding> findings) {
  for (const HostFinding& finding : findings) {
    if (finding.level < FindingLevel::warning) continue;
    spdlog::log(finding.level == FindingLevel::problem ? spdlog::level::err : spdlog::level::warn,
                "host: {}: {}; {}; change: {}", finding.subject, finding.found, finding.why, finding.advice);
  }
}

}  // namespace plchost
