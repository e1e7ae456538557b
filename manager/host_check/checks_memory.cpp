#include <sstream>

#include <fmt/format.h>

#include "manager/host_check/checks.hpp"

namespace plchost::host_check {

namespace {

// A switch of the kernel that costs latency while it is on.
struct Switch {
  const char* path;
  const char* subject;
  const char* why;
  const char* advice;
  FindingLevel on;
};

HostFinding judge(const CheckedHost& host, const Switch& which) {
  if (auto off = unless_on(host.files, which.path, which.subject, which.why)) return *std::move(off);
  return finding(which.on, which.subject, "on", which.why, which.advice);
}

}  // namespace

HostFinding swap(const CheckedHost& host) {
  constexpr auto kSubject = "swap";
  constexpr auto kWhy =
      "instances are locked in memory; other memory that is written out and read again keeps disk and kernel "
      "busy";
  const auto text = host.files.text("/proc/swaps");
  if (!text) return unknown(kSubject, text.error(), kWhy);
  std::istringstream lines(*text);
  std::string line;
  if (!std::getline(lines, line) || !line.starts_with("Filename")) {
    return unknown(kSubject, {ErrorCode::corrupt, 0, "/proc/swaps is not of the known form"}, kWhy);
  }
  std::string areas;
  while (std::getline(lines, line))
    areas += (areas.empty() ? "" : ", ") + line.substr(0, line.find_first_of(" \t"));
  if (areas.empty()) return finding(FindingLevel::ok, kSubject, "none", kWhy);
  return finding(FindingLevel::note, kSubject, areas, kWhy, "swapoff -a, and take it out of /etc/fstab");
}

HostFinding huge_pages(const CheckedHost& host) {
  const std::string path = "/sys/kernel/mm/transparent_hugepage/enabled";
  constexpr auto kSubject = "transparent huge pages";
  constexpr auto kWhy =
      "the kernel rearranges the memory of running programs into huge pages; a thread that touches it then "
      "waits";
  if (!host.files.exists("/sys/kernel/mm/transparent_hugepage") && host.files.exists("/sys/kernel/mm")) {
    return finding(FindingLevel::ok, kSubject, "the kernel has none", kWhy);
  }
  const auto text = host.files.text(path);
  if (!text) return unknown(kSubject, text.error(), kWhy);
  for (const char* mode : {"always", "madvise", "never"}) {
    if (text->find(fmt::format("[{}]", mode)) == std::string::npos) continue;
    if (std::string_view(mode) != "always") return finding(FindingLevel::ok, kSubject, mode, kWhy);
    return finding(FindingLevel::note, kSubject, mode, kWhy, fmt::format("echo madvise > {}", path));
  }
  return unknown(kSubject, {ErrorCode::corrupt, 0, path + " is not of the known form"}, kWhy);
}

HostFinding compaction(const CheckedHost& host) {
  return judge(
      host, {.path = "/proc/sys/vm/compact_unevictable_allowed",
             .subject = "compaction of locked memory",
             .why = "the kernel moves pages although they are locked; a thread that touches one then waits",
             .advice = "sysctl -w vm.compact_unevictable_allowed=0",
             .on = FindingLevel::note});
}

HostFinding numa_balancing(const CheckedHost& host) {
  return judge(
      host,
      {.path = "/proc/sys/kernel/numa_balancing",
       .subject = "NUMA balancing",
       .why = "it sometimes takes pages away to see who touches them: page faults in spite of locked memory",
       .advice = "sysctl -w kernel.numa_balancing=0",
       .on = FindingLevel::warning});
}

}  // namespace plchost::host_check
