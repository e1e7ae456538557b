#include "instances/runtime/setup/own_group.hpp"

#include <string_view>

#include <fmt/format.h>

#include "shm/files/kernel_file.hpp"

namespace plchost {

std::string take_own_group(const LaunchOptions& launch) {
  constexpr std::string_view kThisProcess = "0";
  std::string refused;
  if (!launch.control_group.empty()) {
    const auto moved = write_kernel_file(launch.control_group + "/cgroup.procs", kThisProcess);
    if (!moved)
      refused = fmt::format("it runs in the manager's control group, without limits of its own: {}",
                            moved.error().describe());
  }
  if (launch.oom_score) {
    const auto set = write_kernel_file("/proc/self/oom_score_adj", fmt::format("{}", *launch.oom_score));
    if (!set)
      refused += fmt::format("{}it keeps the manager's OOM score: {}", refused.empty() ? "" : "; ",
                             set.error().describe());
  }
  return refused;
}

}  // namespace plchost
