#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/result.hpp"

namespace plchost {

/// The folder of a process in the hierarchy of control groups of version 2: "/system.slice/x.service".
/// Empty: it is in none. `text`: of /proc/PID/cgroup.
[[nodiscard]] std::string own_control_group(std::string_view text);
/// Where that hierarchy is mounted; empty: nowhere. `text`: of /proc/self/mountinfo.
[[nodiscard]] std::string control_group_mount(std::string_view text);
/// The folder of plchost-instances.service beside the unit that the process is in; empty: it is in no unit.
[[nodiscard]] std::string groups_beside(std::string_view mount, std::string_view own);

/// Whether the kernel has ended a process for want of memory. `text`: of memory.events.
[[nodiscard]] bool tells_oom_kill(std::string_view text);
/// The group of an instance in the folder of groups, as its page is called in /dev/shm.
[[nodiscard]] std::string control_group_name(std::string_view pool, std::string_view instance);

/// Limits of all processes of an instance together; 0: none.
struct GroupLimits {
  std::uint64_t memory_bytes = 0;
  std::uint64_t pids = 0;  ///< processes and threads
};

/// The control groups of the instances, one for each, in one folder that is the manager's to write. Needs
/// version 2. A restart of the manager leaves them as they are. All of it: one thread, waits for nothing.
class ControlGroups {
 public:
  /// A controller that sets no limits there, and why not.
  struct Missing {
    std::string_view controller;
    std::string why;
  };
  struct Made {
    std::string folder;
    std::vector<std::string> refused;  ///< limits that the kernel did not take
  };

  /// `folder`: of [host] instance_groups; empty: as groups_beside() says.
  [[nodiscard]] static ControlGroups find(const std::string& folder);

  [[nodiscard]] const std::string& folder() const noexcept { return folder_; }
  /// Why there are no groups; empty: there are.
  [[nodiscard]] const std::string& problem() const noexcept { return problem_; }
  [[nodiscard]] const std::vector<Missing>& missing() const noexcept { return missing_; }

  /// Makes a group, or uses the one that is there, and gives it these limits and no others. A limit whose
  /// controller is missing does not hold. unavailable: there are no groups.
  [[nodiscard]] Result<Made> make(const std::string& name, const GroupLimits& limits);
  /// SIGKILL to all processes in a group at once, also to those that are just being forked.
  void kill(const std::string& name) const noexcept;
  /// Whether the kernel has ended a process of the group for want of memory, since it was made.
  [[nodiscard]] bool was_out_of_memory(const std::string& name) const;
  /// Ends all processes as kill() does, and the group goes when the last of them has ended.
  void end(const std::string& name);
  /// Removes groups that have ended. To be called periodically. True: none is left to remove.
  bool remove_ended();
  /// Removes those whose names begin with this and in which no process is: of instances that ended unwatched.
  void remove_empty(std::string_view prefix) const;

 private:
  void look_at_folder(bool named);
  void enable_controllers();
  [[nodiscard]] std::string path(const std::string& name) const { return folder_ + "/" + name; }

  std::string folder_;
  std::string problem_;
  std::vector<Missing> missing_;
  std::vector<std::string> ended_;
};

}  // namespace plchost
