#pragma once

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>

#include "manager/system/control_groups.hpp"
#include "tests/support/in_a_child.hpp"
#include "tests/support/own_name.hpp"

namespace plchost {

/// A folder for control groups of version 2, below where this machine has them mounted. All processes in it
/// end with it.
class GroupFolder {
 public:
  GroupFolder() {
    std::ifstream file("/proc/self/mountinfo");
    const std::string mounts{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    const std::string mount = control_group_mount(mounts);
    std::error_code error;
    if (mount.empty()) return;
    path_ = std::filesystem::path(mount) / own_name("groups");
    made_ = std::filesystem::create_directory(path_, error);
    there_ = made_ && std::filesystem::exists(path_ / "cgroup.kill", error) && can_be_entered();
  }
  ~GroupFolder() {
    if (!made_) return;
    std::ofstream(path_ / "cgroup.kill") << 1;
    for (int i = 0; i < 200 && !remove(path_); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  GroupFolder(const GroupFolder&) = delete;
  GroupFolder& operator=(const GroupFolder&) = delete;

  [[nodiscard]] bool there() const noexcept { return there_; }
  [[nodiscard]] std::string path() const { return path_; }
  [[nodiscard]] bool has(const std::string& name) const { return std::filesystem::exists(path_ / name); }
  [[nodiscard]] std::string text(const std::string& name, const std::string& file) const {
    std::ifstream stream(path_ / name / file);
    std::string line;
    std::getline(stream, line);
    return line;
  }
  /// The processes in a group.
  [[nodiscard]] int processes(const std::string& name) const {
    std::ifstream file(path_ / name / "cgroup.procs");
    int count = 0;
    for (std::string line; std::getline(file, line);) ++count;
    return count;
  }
  /// Processes in a group, as often as needed within 10 s.
  [[nodiscard]] bool comes_to(const std::string& name, int count) const {
    for (int i = 0; i < 1000 && processes(name) != count; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return processes(name) == count;
  }

 private:
  // From the group of this process: in a container that may be refused.
  [[nodiscard]] bool can_be_entered() const {
    return in_a_child([this] {
             std::ofstream file(path_ / "cgroup.procs");
             file << 0 << std::flush;
             return std::string(file.good() ? "yes" : "no");
           }) == "yes";
  }
  static bool remove(const std::filesystem::path& folder) {
    std::error_code error;
    for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end;
         at.increment(error)) {
      std::error_code ignored;
      if (at->is_directory(ignored)) (void)remove(at->path());
    }
    return std::filesystem::remove(folder, error);
  }

  std::filesystem::path path_;
  bool made_ = false;
  bool there_ = false;
};

/// The reason of a test that is skipped without one.
inline constexpr const char* kNoGroupFolder = "needs control groups of version 2 that this user may write";

}  // namespace plchost
