#include "manager/config/check_relations.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string_view>

#include <fmt/format.h>
#include <linux/magic.h>
#include <sys/vfs.h>
#include <unistd.h>

#include "shm/base/names.hpp"
#include "shm/toml/section_reader.hpp"

namespace plchost {

namespace {

struct Relations {
  const ManagerConfig& config;
  const ConfigLines& lines;
  std::vector<ConfigProblem>& problems;

  void problem(unsigned line, std::size_t index, std::string_view text) const {
    problems.push_back({line, fmt::format("[[instance]] '{}' {}", config.instances[index].name, text)});
  }
  [[nodiscard]] std::size_t index_of(std::string_view name) const {
    const auto found = std::ranges::find(config.instances, name, &InstanceConfig::name);
    return static_cast<std::size_t>(found - config.instances.begin());
  }

  void check_names() const;
  void check_cores(const std::vector<int>& online) const;
  void check_sharing() const;
  void check_after() const;
  void check_circles() const;
};

void Relations::check_names() const {
  for (std::size_t i = 0; i < config.instances.size(); ++i) {
    const std::size_t first = index_of(config.instances[i].name);
    if (first < i && !config.instances[i].name.empty()) {
      problem(lines[i].name, i, fmt::format("name: is taken already in line {}", lines[first].name));
    }
  }
}

void Relations::check_cores(const std::vector<int>& online) const {
  const auto& allowed = config.host.cores;
  if (allowed.empty()) return;  // reported where it was read
  for (std::size_t i = 0; i < config.instances.size(); ++i) {
    const int core = config.instances[i].core;
    if (core < 0) continue;  // reported where it was read
    if (std::ranges::find(online, core) == online.end()) {
      problem(lines[i].core, i,
              fmt::format("core: core {} is not online; online are {}", core, fmt::join(online, ", ")));
    } else if (std::ranges::find(allowed, core) == allowed.end()) {
      problem(lines[i].core, i,
              fmt::format("core: core {} is not allowed; [host] cores allows {}", core,
                          fmt::join(allowed, ", ")));
    }
  }
}

void Relations::check_sharing() const {
  for (std::size_t i = 0; i < config.instances.size(); ++i) {
    const InstanceConfig& one = config.instances[i];
    if (one.core < 0 || one.share_core) continue;
    for (std::size_t other = 0; other < config.instances.size(); ++other) {
      if (other == i || config.instances[other].core != one.core) continue;
      problem(lines[i].core, i,
              fmt::format("core: core {} is also used by '{}'; give it another one, or say share_core = true "
                          "for all that share it",
                          one.core, config.instances[other].name));
      break;
    }
  }
}

void Relations::check_after() const {
  std::vector<std::string_view> names;
  for (const InstanceConfig& instance : config.instances) names.push_back(instance.name);
  for (std::size_t i = 0; i < config.instances.size(); ++i) {
    for (const std::string& name : config.instances[i].after) {
      if (name == config.instances[i].name) {
        problem(lines[i].after, i, "after: it cannot come after itself");
      } else if (index_of(name) == names.size()) {
        problem(lines[i].after, i,
                fmt::format("after: there is no instance '{}'; there are {}{}", name.substr(0, kMaxPath),
                            join_names(names), suggestion(name, names)));
      }
    }
  }
}

// Depth first over at most kMaxInstances instances; each circle is reported once, at its first instance.
void Relations::check_circles() const {
  enum class Mark : std::uint8_t { unseen, on_path, done };
  std::vector<Mark> marks(config.instances.size(), Mark::unseen);
  std::vector<std::size_t> path;
  auto visit = [&](auto& self, std::size_t i) -> void {
    marks[i] = Mark::on_path;
    path.push_back(i);
    for (const std::string& name : config.instances[i].after) {
      const std::size_t next = index_of(name);
      if (next >= config.instances.size() || next == i) continue;
      if (marks[next] == Mark::unseen) {
        self(self, next);
      } else if (marks[next] == Mark::on_path) {
        std::string circle;
        for (auto at = std::ranges::find(path, next); at != path.end(); ++at) {
          circle += fmt::format("{} after ", config.instances[*at].name);
        }
        problem(lines[next].after, next, fmt::format("after: goes in a circle: {}{}", circle, name));
      }
    }
    path.pop_back();
    marks[i] = Mark::done;
  };
  for (std::size_t i = 0; i < config.instances.size(); ++i) {
    if (marks[i] == Mark::unseen) visit(visit, i);
  }
}

}  // namespace

void check_relations(const ManagerConfig& config, const ConfigLines& lines, const std::vector<int>& online,
                     std::vector<ConfigProblem>& problems) {
  const Relations relations{.config = config, .lines = lines, .problems = problems};
  relations.check_names();
  relations.check_cores(online);
  relations.check_sharing();
  relations.check_after();
  relations.check_circles();
}

namespace {

// Root may write there as far as access() can tell, but nobody can make a folder or a file.
bool is_made_by_the_kernel(const std::filesystem::path& folder) noexcept {
  constexpr std::array<std::int64_t, 7> kKinds{PROC_SUPER_MAGIC,    SYSFS_MAGIC,   CGROUP_SUPER_MAGIC,
                                               CGROUP2_SUPER_MAGIC, DEBUGFS_MAGIC, TRACEFS_MAGIC,
                                               DEVPTS_SUPER_MAGIC};
  struct statfs status{};
  return ::statfs(folder.c_str(), &status) == 0 &&
         std::ranges::find(kKinds, std::int64_t{status.f_type}) != kKinds.end();
}

}  // namespace

Result<void> check_directory_can_be_made(const std::string& path) {
  std::error_code error;
  std::filesystem::path there = path;
  while (!std::filesystem::exists(there, error) && there.has_relative_path()) there = there.parent_path();
  if (!std::filesystem::is_directory(there, error)) {
    return failure(ErrorCode::wrong_type, fmt::format("{} is not a folder", there.native()));
  }
  if (is_made_by_the_kernel(there)) {
    return failure(
        ErrorCode::refused,
        fmt::format("{} holds only what the kernel shows there: name a folder of a file system for "
                    "files",
                    there.native()));
  }
  if (::access(there.c_str(), W_OK | X_OK) != 0) {
    return failure(ErrorCode::refused,
                   fmt::format("{} cannot be written: {}", there.native(), std::strerror(errno)));
  }
  return {};
}

}  // namespace plchost
