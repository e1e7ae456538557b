#include <algorithm>

#include <fmt/format.h>

#include "manager/host_check/checks.hpp"

namespace plchost::host_check {

namespace {

struct DeepestState {
  std::string name;
  std::int64_t latency_us = 0;
};

// The state of the core that is enabled and takes longest to wake up from.
DeepestState deepest_state(const HostFiles& files, int core) {
  const std::string folder = fmt::format("/sys/devices/system/cpu/cpu{}/cpuidle", core);
  DeepestState deepest;
  for (const std::string& state : files.names(folder).value_or(std::vector<std::string>())) {
    const std::string path = fmt::format("{}/{}", folder, state);
    const auto latency = files.number(path + "/latency");
    const auto disabled = files.number(path + "/disable");
    if (!latency || *latency < deepest.latency_us || (disabled && *disabled != 0)) continue;
    deepest = {files.text(path + "/name").value_or(state), *latency};
  }
  return deepest;
}

}  // namespace

HostFinding idle_states(const CheckedHost& host) {
  constexpr auto kSubject = "idle states";
  constexpr auto kWhy =
      "held, an idle core wakes up in 19 instead of 37 us, and for another core's post in 3 instead of 36 us";
  const std::string device = "/dev/cpu_dma_latency";
  const auto driver = host.files.text("/sys/devices/system/cpu/cpuidle/current_driver");
  const auto cores = plc_cores(host);
  const DeepestState deepest = deepest_state(host.files, cores.empty() ? 0 : cores.front());
  std::string found = driver ? fmt::format("driver {}", *driver)
                             : fmt::format("driver not known: {}", driver.error().describe());
  if (!deepest.name.empty())
    found += fmt::format(", deepest state {} ({} us)", deepest.name, deepest.latency_us);
  if (const auto writable = host.files.writable(device); !writable) {
    return finding(FindingLevel::warning, kSubject,
                   fmt::format("{}; instances cannot hold them off: {}", found, writable.error().describe()),
                   kWhy,
                   "let the manager write " + device +
                       ": run it as root, or allow the device in its unit file or container; or boot with "
                       "cpuidle.off=1");
  }
  return finding(FindingLevel::ok, kSubject,
                 fmt::format("{}; instances can hold them off by {}", found, device), kWhy);
}

HostFinding governor(const CheckedHost& host) {
  constexpr auto kSubject = "frequency governor";
  constexpr auto kWhy =
      "a core that has been idle computes slowly at first: the same cycle takes several times as long";
  std::vector<int> slow;
  std::string names;
  for (const int core : plc_cores(host)) {
    const std::string folder = fmt::format("/sys/devices/system/cpu/cpu{}/cpufreq", core);
    if (host.files.kernel_lacks(folder))
      return finding(FindingLevel::ok, kSubject, "the kernel changes no frequency", kWhy);
    const auto name = host.files.text(folder + "/scaling_governor");
    if (!name) return unknown(kSubject, name.error(), kWhy);
    if (*name == "performance") continue;
    slow.push_back(core);
    if (names.find(*name) == std::string::npos) names += (names.empty() ? "" : ", ") + *name;
  }
  if (slow.empty())
    return finding(FindingLevel::ok, kSubject,
                   plc_cores(host).empty() ? "no instance has a core" : "performance", kWhy);
  return finding(FindingLevel::warning, name_cores(host, slow), names, kWhy,
                 "echo performance > /sys/devices/system/cpu/cpuN/cpufreq/scaling_governor for each of them");
}

}  // namespace plchost::host_check
