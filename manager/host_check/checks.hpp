#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "manager/host_check/host_check.hpp"

/// The checks, by what they look at. Each is a pure function of the host; a fact that it cannot read becomes
/// a note, with the file and the reason.
namespace plchost::host_check {

// checks_rights.cpp
HostFinding real_time_class(const CheckedHost& host);
HostFinding priority_limit(const CheckedHost& host);
HostFinding memory_lock(const CheckedHost& host);
HostFinding allowed_cores(const CheckedHost& host);
HostFinding cpu_quota(const CheckedHost& host);
HostFinding instance_limits(const CheckedHost& host);
// checks_kernel.cpp
HostFinding preemption(const CheckedHost& host);
HostFinding throttling(const CheckedHost& host);
HostFinding timer_slack(const CheckedHost& host);
HostFinding timer_migration(const CheckedHost& host);
HostFinding clock_source(const CheckedHost& host);
HostFinding watchdog(const CheckedHost& host);
// checks_cores.cpp
HostFinding isolated_cores(const CheckedHost& host);
HostFinding tick(const CheckedHost& host);
HostFinding rcu_callbacks(const CheckedHost& host);
HostFinding siblings(const CheckedHost& host);
HostFinding housekeeping(const CheckedHost& host);
HostFinding shared_cores(const CheckedHost& host);
HostFinding workqueues(const CheckedHost& host);
// checks_power.cpp
HostFinding idle_states(const CheckedHost& host);
HostFinding governor(const CheckedHost& host);
// checks_interrupts.cpp
HostFinding interrupts(const CheckedHost& host);
HostFinding default_interrupts(const CheckedHost& host);
// checks_memory.cpp
HostFinding swap(const CheckedHost& host);
HostFinding huge_pages(const CheckedHost& host);
HostFinding compaction(const CheckedHost& host);
HostFinding numa_balancing(const CheckedHost& host);
// checks_machine.cpp
HostFinding machine(const CheckedHost& host);
HostFinding container(const CheckedHost& host);

// Their common parts: check_parts.cpp

/// A finding of that level, before its check has filled in more.
[[nodiscard]] HostFinding finding(FindingLevel level, std::string subject, std::string found,
                                  std::string why = {}, std::string advice = {});
/// A note that this cannot be known, and why not.
[[nodiscard]] HostFinding unknown(std::string subject, const Error& error, std::string why);

/// The file that says that this is a container; empty: none does.
[[nodiscard]] std::string container_mark(const HostFiles& files);
/// Whether process 2 is no thread of the kernel, as in each PID namespace but the first: a container, also of
/// a runtime that leaves no such file (containerd, CRI-O).
[[nodiscard]] bool has_its_own_processes(const HostFiles& files);

/// Of a number of the kernel that switches something on: the finding when it is off, not there or not known.
/// Nothing: it is on.
[[nodiscard]] std::optional<HostFinding> unless_on(const HostFiles& files, const std::string& path,
                                                   const std::string& subject, const std::string& why);

/// The cores of the instances, sorted, each once.
[[nodiscard]] std::vector<int> plc_cores(const CheckedHost& host);
/// `parts` one after the other, at most `most` of them: "a, b, and 62 more".
[[nodiscard]] std::string join_some(const std::vector<std::string>& parts, std::string_view separator,
                                    std::size_t most);
/// "core 1 (line1, line2), core 2 (line3)", with the instances on each. Of more than eight instances:
/// "64 instances on cores 2-65 (line1, line2, line3, and 61 more)". `cores` are sorted.
[[nodiscard]] std::string name_cores(const CheckedHost& host, const std::vector<int>& cores);

/// The cores that the kernel's scheduler leaves alone: isolcpus= and isolated cpusets.
[[nodiscard]] Result<std::vector<int>> isolated(const HostFiles& files);

/// The value of `key=value` on the kernel's command line, the last one; empty: not there.
[[nodiscard]] std::string boot_value(std::string_view command_line, std::string_view key);

/// The folders of the control groups in which a controller limits a process, its own first and then upwards.
/// Empty: there are none, or it cannot be known. `process`: its number, or "self".
[[nodiscard]] std::vector<std::string> group_folders(const HostFiles& files, std::string_view controller,
                                                     const std::string& process = "self");
/// The same of an instance: where its process is, or where its next one will be.
[[nodiscard]] std::vector<std::string> group_folders_of(const CheckedHost& host,
                                                        const CheckedHost::Instance& instance,
                                                        std::string_view controller);

/// A capability of this process is effective.
[[nodiscard]] Result<bool> has_capability(const HostFiles& files, unsigned capability);
/// A soft limit of this process, as /proc/self/limits has it ("unlimited" or a number).
[[nodiscard]] Result<std::string> soft_limit(const HostFiles& files, std::string_view name);

}  // namespace plchost::host_check
