#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/process/user_account.hpp"

namespace plchost {

/// The user that instances run as; nothing: that of the manager.
using InstanceUser = std::optional<UserAccount>;

/// Lets these users make files in a folder of the manager, and keeps those of others from them. Without a
/// user it takes that back. Where the file system has no access lists it lets the manager's group, and logs
/// that. refused, system: the folder stays as it was. Waits for the disk of the folder.
[[nodiscard]] Result<void> share_with_instances(const std::string& folder, std::span<const uid_t> users);

/// Instances of a run directory: all that it has had, or those whose processes run.
enum class Claims : bool { all, held };
/// The other users that they have had, by the files that they made there: the files that they left are used.
[[nodiscard]] std::vector<uid_t> users_in(const std::string& run_directory, Claims which = Claims::all);

/// Of an instance that is to be started, and runs as another user than its process before.
struct LeftFiles {
  std::string instance;
  std::string pool;
  std::string run_directory;
};
/// Gives that user what the process before has left: of its files the one to come may replace only its own.
/// Files with contents and the memory of retain variables keep them; sockets, claims and pages go.
void hand_over_files(const LeftFiles& left, const InstanceUser& user);
/// The same of its retain files. Waits for their disk.
void hand_over_retain_files(const std::string& state_directory, const std::string& instance,
                            const InstanceUser& user);

/// The lock files by which a process has the name of the instance: in its run directory, and in the pool. The
/// latter also tells of a process with another run directory.
[[nodiscard]] std::array<std::string, 2> claims_of(const LeftFiles& left);
/// The owner of a lock file that a process has locked. Nothing: nobody has, or it is no plain file.
[[nodiscard]] std::optional<uid_t> user_that_holds(const std::string& path);
/// Renames a folder in the place of a file of the manager, in the same folder, and logs it. The user of
/// instances may have made it, with files that cannot be removed.
void put_folder_aside(const std::string& path);

/// end_outputs() with the rights of the user whose page it is: it names devices and files.
void end_outputs_of(const std::string& pool, const std::string& instance);

}  // namespace plchost
