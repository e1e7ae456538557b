#pragma once

#include <optional>
#include <string>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/process/user_account.hpp"

namespace plchost {

/// The user that instances run as; nothing: that of the manager.
using InstanceUser = std::optional<UserAccount>;

/// Lets that user make files in a folder of the manager, and keeps those of others from him. Without a user
/// it takes that back. refused, system: the folder stays as it was. Waits for the disk of the folder.
[[nodiscard]] Result<void> share_with_instances(const std::string& folder, const InstanceUser& user);

/// The users that instances of this run directory have had, by the files that they made there: some may still
/// run, and what they have left is used.
[[nodiscard]] std::vector<uid_t> users_in(const std::string& run_directory);

/// Of an instance that is to be started, and runs as another user than its process before.
struct LeftFiles {
  std::string instance;
  std::string pool;
  std::string run_directory;
};
/// Gives that user what the process before has left: of its files the one to come may replace only its own.
/// Files with contents keep them, sockets, claims and pages go.
void hand_over_files(const LeftFiles& left, const InstanceUser& user);
/// The same of its retain files. Waits for their disk.
void hand_over_retain_files(const std::string& state_directory, const std::string& instance,
                            const InstanceUser& user);

/// The owner of a lock file that a process has locked. Nothing: nobody has, or it is no plain file.
[[nodiscard]] std::optional<uid_t> user_that_holds(const std::string& path);
/// Renames a folder in the place of a file of the manager, in the same folder, and logs it. The user of
/// instances may have made it, with files that cannot be removed.
void put_folder_aside(const std::string& path);

/// end_outputs() with the rights of the user whose page it is: it names devices and files.
void end_outputs_of(const std::string& pool, const std::string& instance);

}  // namespace plchost
