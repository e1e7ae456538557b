#include "manager/system/control_groups.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <utility>

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

bool lists(std::string_view list, std::string_view controller) {
  for (std::size_t at = 0; !controller.empty() && at <= list.size();) {
    const std::size_t end = std::min(list.find(',', at), list.size());
    if (list.substr(at, end - at) == controller) return true;
    at = end + 1;
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

// Lines of the form "oom_kill 2".
std::uint64_t count_in(std::string_view text, std::string_view wanted) {
  std::istringstream words{std::string(text)};
  std::string what;
  for (std::uint64_t times = 0; words >> what >> times;) {
    if (what == wanted) return times;
  }
  return 0;
}

std::string limit_text(std::uint64_t limit) {
  return limit == 0 ? "max" : fmt::format("{}", limit);
}

}  // namespace

// "4:cpu,cpuacct:/path", and "0::/path" of version 2.
std::optional<GroupPlace> group_place(std::string_view text, std::string_view controller) {
  std::optional<GroupPlace> place;
  std::istringstream lines{std::string(text)};
  for (std::string line; std::getline(lines, line);) {
    const std::size_t first = line.find(':');
    const std::size_t second = first == std::string::npos ? first : line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string list = line.substr(first + 1, second - first - 1);
    const bool version2 = list.empty() && line.starts_with("0:");
    if (version2 ? !place : lists(list, controller))
      place = GroupPlace{.controllers = list, .path = line.substr(second + 1)};
  }
  return place;
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

GroupCounts group_counts(std::string_view memory, std::string_view pids) {
  return {.oom_kills = count_in(memory, "oom_kill"), .pids_refused = count_in(pids, "max")};
}

GroupCounts counts_of_group(const std::string& folder) {
  if (folder.empty()) return {};
  return group_counts(text_of_file(folder + "/memory.events"), text_of_file(folder + "/pids.events"));
}

std::string control_group_name(std::string_view pool, std::string_view instance) {
  return fmt::format("{}.instance.{}", pool, instance);
}

// No name has a colon, but names may have dots: of no pool is it the group of an instance.
std::string trial_group_name(std::string_view pool, std::string_view instance) {
  return fmt::format("{}:trial:{}", pool, instance);
}

ControlGroups ControlGroups::find(const std::string& folder) {
  ControlGroups groups;
  groups.folder_ = folder;
  if (folder.empty()) {
    const std::string mount = control_group_mount(text_of_file("/proc/self/mountinfo"));
    const auto own = group_place(text_of_file("/proc/self/cgroup"), "");
    groups.folder_ = groups_beside(mount, own ? own->path : "");
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
  (void)remove_group(made.folder);  // one without a process: its limits and counts are those of earlier ones
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
  take_over(name);
  return made;
}

void ControlGroups::kill(const std::string& name) const noexcept {
  if (problem_.empty()) (void)write_kernel_file(path(name) + "/cgroup.kill", "1");
}

void ControlGroups::take_over(const std::string& name) {
  if (problem_.empty()) before_[name] = counts_of_group(path(name));
}

GroupCounts ControlGroups::counts(const std::string& name) const {
  if (!problem_.empty()) return {};
  const GroupCounts now = counts_of_group(path(name));
  const auto found = before_.find(name);
  const GroupCounts before = found == before_.end() ? GroupCounts{} : found->second;
  const auto more = [](std::uint64_t count, std::uint64_t than) { return count > than ? count - than : 0; };
  return {.oom_kills = more(now.oom_kills, before.oom_kills),
          .pids_refused = more(now.pids_refused, before.pids_refused)};
}

void ControlGroups::end(const std::string& name) {
  if (!problem_.empty() || ::access(path(name).c_str(), F_OK) != 0) return;
  kill(name);
  before_.erase(name);
  if (std::ranges::find(ended_, name) == ended_.end()) ended_.push_back(name);
  (void)remove_ended();
}

void ControlGroups::end_all(std::string_view prefix) {
  for (const std::string& name : with_prefix(prefix)) end(name);
}

std::vector<std::string> ControlGroups::with_prefix(std::string_view prefix) const {
  std::vector<std::string> found;
  if (!problem_.empty()) return found;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder_, error), end; !error && at != end;
       at.increment(error)) {
    std::string name = at->path().filename();
    if (name.starts_with(prefix)) found.push_back(std::move(name));
  }
  return found;
}

bool ControlGroups::remove_ended() {
  std::erase_if(ended_, [&](const std::string& name) { return remove_group(path(name)); });
  return ended_.empty();
}

void ControlGroups::remove_empty(std::string_view prefix) const {
  for (const std::string& name : with_prefix(prefix)) (void)::rmdir(path(name).c_str());
}

std::string TrialGroup::begin() const {
  if (groups_ == nullptr || !groups_->problem().empty()) return {};
  // The process that tries it has one thread more than an instance with the same tasks.
  GroupLimits limits = limits_();
  if (limits.pids != 0) ++limits.pids;
  groups_->kill(name_);  // a trial of an earlier manager
  const auto made = groups_->make(name_, limits);
  return made ? made->folder : std::string();
}

void TrialGroup::end() const {
  if (groups_ != nullptr) groups_->end(name_);
}

}  // namespace plchost
