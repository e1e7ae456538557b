#include <algorithm>
#include <charconv>
#include <cstdint>
#include <sstream>

#include <fmt/format.h>

#include "manager/host_check/checks.hpp"
#include "manager/system/control_groups.hpp"
#include "shm/base/cpu_list.hpp"

namespace plchost::host_check {

HostFinding finding(FindingLevel level, std::string subject, std::string found, std::string why,
                    std::string advice) {
  return {.id = {},
          .level = level,
          .subject = std::move(subject),
          .found = std::move(found),
          .why = std::move(why),
          .advice = std::move(advice)};
}

HostFinding unknown(std::string subject, const Error& error, std::string why) {
  return finding(FindingLevel::note, std::move(subject), fmt::format("not known: {}", error.describe()),
                 std::move(why));
}

std::string container_mark(const HostFiles& files) {
  // Of systemd, podman, docker.
  for (const char* const mark : {"/run/systemd/container", "/run/.containerenv", "/.dockerenv"}) {
    if (files.exists(mark)) return mark;
  }
  return {};
}

bool has_its_own_processes(const HostFiles& files) {
  return files.exists("/proc/1/comm") && files.text("/proc/2/comm").value_or("") != "kthreadd";
}

std::optional<HostFinding> unless_on(const HostFiles& files, const std::string& path,
                                     const std::string& subject, const std::string& why) {
  if (files.kernel_lacks(path)) return finding(FindingLevel::ok, subject, "the kernel has none", why);
  const auto value = files.number(path);
  if (!value) return unknown(subject, value.error(), why);
  if (*value == 0) return finding(FindingLevel::ok, subject, "off", why);
  return std::nullopt;
}

std::vector<int> plc_cores(const CheckedHost& host) {
  std::vector<int> cores;
  for (const CheckedHost::Instance& instance : host.instances) cores.push_back(instance.core);
  return each_once(std::move(cores));
}

std::string join_some(const std::vector<std::string>& parts, std::string_view separator, std::size_t most) {
  const std::size_t shown = std::min(parts.size(), most);
  const auto end = parts.begin() + static_cast<std::ptrdiff_t>(shown);
  std::string text = fmt::format("{}", fmt::join(parts.begin(), end, separator));
  if (shown < parts.size()) text += fmt::format("{}and {} more", separator, parts.size() - shown);
  return text;
}

std::string name_cores(const CheckedHost& host, const std::vector<int>& cores) {
  constexpr std::size_t kEachNamed = 8;  // instances; of more of them the first ones
  constexpr std::size_t kNamed = 3;
  std::vector<std::string> all;
  for (const CheckedHost::Instance& instance : host.instances) {
    if (std::ranges::binary_search(cores, instance.core)) all.push_back(instance.name);
  }
  if (all.size() > kEachNamed) {
    return fmt::format("{} instances on core{} {} ({})", all.size(), cores.size() == 1 ? "" : "s",
                       format_cpu_list(cores), join_some(all, ", ", kNamed));
  }
  std::string text;
  for (const int core : cores) {
    std::string names;
    for (const CheckedHost::Instance& instance : host.instances) {
      if (instance.core == core) names += fmt::format("{}{}", names.empty() ? "" : ", ", instance.name);
    }
    text += fmt::format("{}core {}", text.empty() ? "" : ", ", core);
    if (!names.empty()) text += fmt::format(" ({})", names);
  }
  return text;
}

Result<std::vector<int>> isolated(const HostFiles& files) {
  auto cores = files.cores("/sys/devices/system/cpu/isolated");
  const auto sets = files.cores("/sys/fs/cgroup/cpuset.cpus.isolated");
  if (!cores || !sets) return cores;
  std::vector<int> all;
  std::ranges::set_union(*cores, *sets, std::back_inserter(all));
  return all;
}

std::string boot_value(std::string_view command_line, std::string_view key) {
  std::string value;
  std::istringstream words{std::string(command_line)};
  for (std::string word; words >> word;) {
    if (word == "--") break;  // the arguments behind it are for init
    if (word.size() > key.size() && word.starts_with(key) && word[key.size()] == '=') {
      value = word.substr(key.size() + 1);
    }
  }
  return value;
}

namespace {

// `folder` and those above it, up to `top`.
std::vector<std::string> folders_upwards(const HostFiles& files, std::string folder, std::string_view top) {
  std::vector<std::string> folders;
  constexpr std::size_t kDeepest = 64;
  while (folder.size() >= top.size() && folders.size() < kDeepest) {
    while (folder.size() > top.size() && folder.ends_with('/')) folder.pop_back();
    // A process in a name space of its own may be told a path that is not there.
    if (files.exists(folder)) folders.push_back(folder);
    folder.resize(folder.rfind('/') == std::string::npos ? 0 : folder.rfind('/'));
  }
  return folders;
}

std::string mount_of_version2(const HostFiles& files) {
  const std::string mount = control_group_mount(files.text("/proc/self/mountinfo").value_or(""));
  return mount.empty() ? "/sys/fs/cgroup" : mount;
}

}  // namespace

std::vector<std::string> group_folders(const HostFiles& files, std::string_view controller,
                                       const std::string& process) {
  const auto groups = files.text(fmt::format("/proc/{}/cgroup", process));
  const auto place = group_place(groups.value_or(""), controller);
  if (!place) return {};
  std::string top = mount_of_version2(files);
  if (!place->controllers.empty()) {
    top = fmt::format("/sys/fs/cgroup/{}", place->controllers);
    if (!files.exists(top)) top = fmt::format("/sys/fs/cgroup/{}", controller);
  }
  return folders_upwards(files, top + place->path, top);
}

std::vector<std::string> group_folders_of(const CheckedHost& host, const CheckedHost::Instance& instance,
                                          std::string_view controller) {
  if (instance.pid != 0) {
    if (auto folders = group_folders(host.files, controller, fmt::format("{}", instance.pid));
        !folders.empty())
      return folders;
  }
  const auto own = group_place(host.files.text("/proc/self/cgroup").value_or(""), controller);
  const bool inherited = !own || !own->controllers.empty() || !host.groups.problem.empty();
  if (inherited) return group_folders(host.files, controller);
  return folders_upwards(host.files, host.groups.folder, mount_of_version2(host.files));
}

Result<bool> has_capability(const HostFiles& files, unsigned capability) {
  const std::string path = "/proc/self/status";
  PLCHOST_TRY_ASSIGN(const auto status, files.text(path));
  constexpr std::string_view kKey = "CapEff:\t";
  const std::size_t at = status.find(kKey);
  if (at != std::string::npos) {
    const char* const begin = status.data() + at + kKey.size();
    std::uint64_t set = 0;
    const auto [stopped, error] = std::from_chars(begin, status.data() + status.size(), set, 16);
    if (error == std::errc()) return (set >> capability & 1U) != 0;
  }
  return failure(ErrorCode::corrupt, fmt::format("{} has no CapEff", path));
}

Result<std::string> soft_limit(const HostFiles& files, std::string_view name) {
  const std::string path = "/proc/self/limits";
  PLCHOST_TRY_ASSIGN(const auto limits, files.text(path));
  std::istringstream lines(limits);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(name)) continue;
    std::istringstream rest(line.substr(name.size()));
    std::string soft;
    rest >> soft;
    const bool number = !soft.empty() && soft.find_first_not_of("0123456789") == std::string::npos;
    if (number || soft == "unlimited") return soft;
  }
  return failure(ErrorCode::corrupt, fmt::format("{} has no '{}'", path, name));
}

}  // namespace plchost::host_check
