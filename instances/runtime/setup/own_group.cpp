#include "instances/runtime/setup/own_group.hpp"

#include <string_view>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

Result<void> tell_kernel(const std::string& path, std::string_view text) {
  const UniqueFd file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
  PLCHOST_TRY(check_errno(file.get(), "cannot open " + path));
  PLCHOST_TRY(check_errno(::write(file.get(), text.data(), text.size()),
                          fmt::format("cannot write {} into {}", text, path)));
  return {};
}

}  // namespace

std::string take_own_group(const LaunchOptions& launch) {
  constexpr std::string_view kThisProcess = "0";
  std::string refused;
  if (!launch.control_group.empty()) {
    const auto moved = tell_kernel(launch.control_group + "/cgroup.procs", kThisProcess);
    if (!moved)
      refused = fmt::format("it runs in the manager's control group, without limits of its own: {}",
                            moved.error().describe());
  }
  if (launch.oom_score) {
    const auto set = tell_kernel("/proc/self/oom_score_adj", fmt::format("{}", *launch.oom_score));
    if (!set)
      refused += fmt::format("{}it keeps the manager's OOM score: {}", refused.empty() ? "" : "; ",
                             set.error().describe());
  }
  return refused;
}

}  // namespace plchost
