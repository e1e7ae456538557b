#include <algorithm>

#include <fmt/format.h>

#include "manager/host_check/checks.hpp"
#include "shm/base/cpu_list.hpp"
#include "shm/base/names.hpp"

namespace plchost::host_check {

namespace {

constexpr std::size_t kShown = 6;

// The drivers that handle an interrupt have a folder each in that of the interrupt; without one it does not
// come.
std::string handlers_of(const HostFiles& files, const std::string& folder) {
  std::string handlers;
  for (const std::string& name : files.names(folder).value_or(std::vector<std::string>())) {
    if (files.names(fmt::format("{}/{}", folder, name))) handlers += (handlers.empty() ? "" : ",") + name;
  }
  return handlers;
}

bool is_number(const std::string& name) {
  return !name.empty() && std::ranges::all_of(name, [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

HostFinding interrupts(const CheckedHost& host) {
  constexpr auto kSubject = "interrupts";
  constexpr auto kWhy = "each one delays the cycle that it hits by the run time of its handler";
  const auto numbers = host.files.names("/proc/irq");
  if (!numbers) return unknown(kSubject, numbers.error(), kWhy);
  const auto cores = plc_cores(host);
  std::vector<std::string> hits;
  std::vector<int> hit_cores;
  std::optional<Error> unreadable;
  for (const std::string& number : *numbers) {
    const std::string folder = "/proc/irq/" + number;
    const std::string handlers = is_number(number) ? handlers_of(host.files, folder) : std::string();
    if (handlers.empty()) continue;
    // Where it really goes, as far as the kernel tells; else where it may go.
    auto goes_to = host.files.cores(folder + "/effective_affinity_list");
    if (!goes_to) goes_to = host.files.cores(folder + "/smp_affinity_list");
    if (!goes_to) {
      unreadable = goes_to.error();
      continue;
    }
    const auto hit = common_cores(cores, *goes_to);
    if (hit.empty()) continue;
    hits.push_back(fmt::format("{} {} on {}", number, handlers, format_cpu_list(hit)));
    hit_cores.insert(hit_cores.end(), hit.begin(), hit.end());
  }
  if (hits.empty() && unreadable) return unknown(kSubject, *unreadable, kWhy);
  if (hits.empty()) return finding(FindingLevel::ok, kSubject, "none comes to an instance's core", kWhy);
  const std::string found =
      fmt::format("{}: {}", count_text(hits.size(), "interrupt"), join_some(hits, "; ", kShown));
  return finding(FindingLevel::warning, name_cores(host, each_once(std::move(hit_cores))), found, kWhy,
                 "boot with irqaffinity= and isolcpus=managed_irq, or write the housekeeping cores to "
                 "/proc/irq/N/smp_affinity_list; keep irqbalance away (IRQBALANCE_BANNED_CPULIST)");
}

HostFinding default_interrupts(const CheckedHost& host) {
  constexpr auto kSubject = "new interrupts";
  constexpr auto kWhy = "a driver that is loaded later may send its interrupts to any of these cores";
  const auto mask = host.files.core_mask("/proc/irq/default_smp_affinity");
  if (!mask) return unknown(kSubject, mask.error(), kWhy);
  const auto hit = common_cores(plc_cores(host), *mask);
  if (hit.empty()) return finding(FindingLevel::ok, kSubject, "not to an instance's core", kWhy);
  return finding(FindingLevel::note, name_cores(host, hit), "in /proc/irq/default_smp_affinity", kWhy,
                 "boot with irqaffinity= and the housekeeping cores");
}

}  // namespace plchost::host_check
