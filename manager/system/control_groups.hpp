#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "shm/base/result.hpp"

namespace plchost {

/// The control group of a process in one hierarchy.
struct GroupPlace {
  std::string controllers;  ///< of a hierarchy of version 1: "cpu,cpuacct"; empty: version 2
  std::string path;         ///< "/system.slice/x.service"
};
/// Where a controller limits a process: in version 1, or, if none of its hierarchies has it, in version 2.
/// Nothing: nowhere. `text`: of /proc/PID/cgroup. `controller`: empty means version 2.
[[nodiscard]] std::optional<GroupPlace> group_place(std::string_view text, std::string_view controller);
/// Where that hierarchy is mounted; empty: nowhere. `text`: of /proc/self/mountinfo.
[[nodiscard]] std::string control_group_mount(std::string_view text);
/// The folder of plchost-instances.service beside the unit that the process is in; empty: it is in no unit.
[[nodiscard]] std::string groups_beside(std::string_view mount, std::string_view own);

/// The limits of a group that were met since it was made.
struct GroupCounts {
  std::uint64_t oom_kills = 0;     ///< processes that the kernel has ended for want of memory
  std::uint64_t pids_refused = 0;  ///< forks and threads beyond pids.max
};
/// `memory`: the text of memory.events, `pids`: of pids.events. A count that is not there is 0.
[[nodiscard]] GroupCounts group_counts(std::string_view memory, std::string_view pids);
/// Those of the group with that folder; empty: none.
[[nodiscard]] GroupCounts counts_of_group(const std::string& folder);
/// The group of an instance in the folder of groups, as its page is called in /dev/shm.
[[nodiscard]] std::string control_group_name(std::string_view pool, std::string_view instance);
/// The group of the trials of its applications.
[[nodiscard]] std::string trial_group_name(std::string_view pool, std::string_view instance);

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
  /// The process of an earlier manager is in it: the counts until now are not those of its end.
  void take_over(const std::string& name);
  /// The limits that were met since the last make() or take_over(). A group that is used again keeps the
  /// kernel's counts of the processes before.
  [[nodiscard]] GroupCounts counts(const std::string& name) const;
  /// Ends all processes as kill() does, and the group goes when the last of them has ended.
  void end(const std::string& name);
  /// The same for all groups whose names begin with this.
  void end_all(std::string_view prefix);
  /// Removes groups that have ended. To be called periodically. True: none is left to remove.
  bool remove_ended();
  /// Removes those whose names begin with this and in which no process is: of instances that ended unwatched.
  void remove_empty(std::string_view prefix) const;

 private:
  void look_at_folder(bool named);
  void enable_controllers();
  [[nodiscard]] std::string path(const std::string& name) const { return folder_ + "/" + name; }
  [[nodiscard]] std::vector<std::string> with_prefix(std::string_view prefix) const;

  std::string folder_;
  std::string problem_;
  std::vector<Missing> missing_;
  std::vector<std::string> ended_;
  std::map<std::string, GroupCounts> before_;  // at make() or take_over()
};

/// The group in which an instance's applications are tried, with the limits of the instance.
class TrialGroup {
 public:
  TrialGroup() = default;
  /// `groups` outlives it. `limits`: those of the instance now.
  TrialGroup(ControlGroups& groups, std::string name, std::function<GroupLimits()> limits)
      : groups_(&groups), name_(std::move(name)), limits_(std::move(limits)) {}

  /// The folder of the group of a trial that begins; empty: it has none.
  [[nodiscard]] std::string begin() const;
  /// The trial has ended. All that it has left there ends, too.
  void end() const;

 private:
  ControlGroups* groups_ = nullptr;
  std::string name_;
  std::function<GroupLimits()> limits_;
};

}  // namespace plchost
