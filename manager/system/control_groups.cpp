#include "manager/system/control_groups.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include <fmt/format.h>
#include <linux/magic.h>
#include <sys/stat.h>
#include <sys/statfs.h>
#include <unistd.h>

#include "shm/files/kernel_file.hpp"

namespace plchost {

namespace {

constexpr std::string_view kUnitOfGroups = "plchost-instances.service";
constexpr std::array<std::string_view, 2> kLimiting = {"memory", "pids"};

std::string text_of_file(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

bool has_word(const std::string& text, std::string_view wanted) {
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (word == wanted) return true;
  }
  return false;
}

// As the kernel writes blanks and the like in paths of mountinfo: "\040".
std::string unescaped(std::string_view text) {
  constexpr std::size_t kLength = 4;
  constexpr unsigned kOctal = 8;
  std::string plain;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const std::string_view digits = text.substr(at).substr(0, kLength);
    const bool escaped = digits.size() == kLength && digits[0] == '\\' &&
                         std::ranges::all_of(digits.substr(1), [](char c) { return c >= '0' && c < '8'; });
    if (!escaped) {
      plain += text[at];
      continue;
    }
    unsigned code = 0;
    for (const char digit : digits.substr(1)) code = code * kOctal + static_cast<unsigned>(digit - '0');
    plain += static_cast<char>(code);
    at += kLength - 1;
  }
  return plain;
}

// With the groups that a process may have made in it. False: a process is in one of them.
bool remove_group(const std::filesystem::path& folder) {
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    std::error_code gone;
    if (at->is_directory(gone)) (void)remove_group(at->path());
  }
  return ::rmdir(folder.c_str()) == 0 || errno == ENOENT;
}

// A limit of a controller that the group does not have is for missing().
Result<void> set_limit(const std::string& group, std::string_view file, std::string_view value) {
  const std::string path = fmt::format("{}/{}", group, file);
  if (::access(path.c_str(), F_OK) != 0) return {};
  return write_kernel_file(path, value);
}

std::string limit_text(std::uint64_t limit) {
  return limit == 0 ? "max" : fmt::format("{}", limit);
}

}  // namespace

std::string own_control_group(std::string_view text) {
  constexpr std::string_view kVersion2 = "0::";
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string_view line = text.substr(at, end - at);
    if (line.starts_with(kVersion2)) return std::string(line.substr(kVersion2.size()));
    at = end + 1;
  }
  return {};
}

// "38 31 0:35 / /sys/fs/cgroup/unified rw - cgroup2 cgroup2 rw": the fourth is the folder that is mounted.
std::string control_group_mount(std::string_view text) {
  std::istringstream lines{std::string(text)};
  for (std::string line; std::getline(lines, line);) {
    const std::size_t separator = line.find(" - ");
    if (separator == std::string::npos || !line.substr(separator).starts_with(" - cgroup2 ")) continue;
    std::istringstream words(line);
    std::string skipped;
    std::string folder;
    std::string where;
    words >> skipped >> skipped >> skipped >> folder >> where;
    if (folder == "/") return unescaped(where);
  }
  return {};
}

std::string groups_beside(std::string_view mount, std::string_view own) {
  if (mount.empty() || !own.ends_with(".service")) return {};
  return fmt::format("{}{}/{}", mount, own.substr(0, own.rfind('/')), kUnitOfGroups);
}

bool tells_oom_kill(std::string_view text) {
  std::istringstream words{std::string(text)};
  std::string what;
  for (std::uint64_t times = 0; words >> what >> times;) {
    if (what == "oom_kill") return times != 0;
  }
  return false;
}

std::string control_group_name(std::string_view pool, std::string_view instance) {
  return fmt::format("{}.instance.{}", pool, instance);
}

ControlGroups ControlGroups::find(const std::string& folder) {
  ControlGroups groups;
  groups.folder_ = folder;
  if (folder.empty()) {
    const std::string mount = control_group_mount(text_of_file("/proc/self/mountinfo"));
    groups.folder_ = groups_beside(mount, own_control_group(text_of_file("/proc/self/cgroup")));
    if (mount.empty()) groups.problem_ = "control groups of version 2 are not mounted";
  }
  if (groups.problem_.empty()) groups.look_at_folder(!folder.empty());
  if (groups.problem_.empty()) groups.enable_controllers();
  return groups;
}

void ControlGroups::look_at_folder(bool named) {
  struct statfs status{};
  if (folder_.empty()) {
    problem_ = "the manager is in no unit of systemd, and [host] instance_groups names no folder";
  } else if (::statfs(folder_.c_str(), &status) != 0) {
    problem_ = fmt::format("{} is not there{}", folder_,
                           named ? "" : fmt::format(": {} does not run", kUnitOfGroups));
  } else if (std::int64_t{status.f_type} != std::int64_t{CGROUP2_SUPER_MAGIC}) {
    problem_ = fmt::format("{} is no control group of version 2", folder_);
  } else if (::access(folder_.c_str(), W_OK | X_OK) != 0) {
    problem_ =
        failure(ErrorCode::refused, fmt::format("{} cannot be written", folder_), errno).error().describe();
  }
}

void ControlGroups::enable_controllers() {
  missing_.clear();
  const std::string offered = text_of_file(folder_ + "/cgroup.controllers");
  for (const std::string_view controller : kLimiting) {
    if (!has_word(offered, controller)) {
      missing_.push_back({controller, "it is not in cgroup.controllers there"});
    } else if (const auto enabled =
                   write_kernel_file(folder_ + "/cgroup.subtree_control", fmt::format("+{}", controller));
               !enabled) {
      missing_.push_back({controller, enabled.error().describe()});
    }
  }
}

Result<ControlGroups::Made> ControlGroups::make(const std::string& name, const GroupLimits& limits) {
  if (!problem_.empty()) return failure(ErrorCode::unavailable, problem_);
  Made made{.folder = path(name), .refused = {}};
  std::erase(ended_, name);
  // Each time: systemd takes them back when somebody starts the unit of the groups anew.
  enable_controllers();
  (void)::rmdir(made.folder.c_str());  // an empty one: its counters are those of an earlier process
  constexpr mode_t kMode = 0755;
  if (::mkdir(made.folder.c_str(), kMode) != 0 && errno != EEXIST)
    return failure(ErrorCode::system, "cannot make the control group " + made.folder, errno);
  const auto set = [&](std::string_view file, const std::string& value) {
    const auto taken = set_limit(made.folder, file, value);
    if (!taken) made.refused.push_back(taken.error().describe());
  };
  set("memory.max", limit_text(limits.memory_bytes));
  set("memory.oom.group", "1");
  set("pids.max", limit_text(limits.pids));
  return made;
}

void ControlGroups::kill(const std::string& name) const noexcept {
  if (problem_.empty()) (void)write_kernel_file(path(name) + "/cgroup.kill", "1");
}

bool ControlGroups::was_out_of_memory(const std::string& name) const {
  return problem_.empty() && tells_oom_kill(text_of_file(path(name) + "/memory.events"));
}

void ControlGroups::end(const std::string& name) {
  if (!problem_.empty() || ::access(path(name).c_str(), F_OK) != 0) return;
  kill(name);
  if (std::ranges::find(ended_, name) == ended_.end()) ended_.push_back(name);
  (void)remove_ended();
}

bool ControlGroups::remove_ended() {
  std::erase_if(ended_, [&](const std::string& name) { return remove_group(path(name)); });
  return ended_.empty();
}

void ControlGroups::remove_empty(std::string_view prefix) const {
  if (!problem_.empty()) return;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder_, error), end; !error && at != end;
       at.increment(error)) {
    if (at->path().filename().native().starts_with(prefix)) (void)::rmdir(at->path().c_str());
  }
}

}  // namespace plchost
