#pragma once

#include <optional>
#include <string>

#include <sys/types.h>

#include "manager/config/manager_config.hpp"
#include "shm/base/result.hpp"
#include "shm/process/user_account.hpp"

namespace plchost {

/// The right of the manager's group to a folder of the state directory.
enum class GroupRight : bool { reads, writes };

/// Gives a folder, and what is in it, to the group of this process: that is how an API server with a user of
/// its own reads or writes it. Makes the folder if it is not there. Files of other users stay as they are,
/// and links are not followed: those who write there have fewer rights than this process. Not for others to
/// read. `folders_group`: that of the folder itself, which keeps all others of the manager's group out.
[[nodiscard]] Result<void> share_folder(const std::string& path, GroupRight right,
                                        std::optional<gid_t> folders_group = std::nullopt);

/// Gives the ledger of posts of a pool to the user that the API server is to have; nothing: that of this
/// process. One that another user has put there is taken away, and logged. For root, while no server runs.
void hand_over_ledger(const std::string& pool, const std::optional<UserAccount>& server);

/// Whether check_own_folder() believes in the state directory of a host and in its own folders there, as far
/// as they are there. refused: the first that it does not believe in.
[[nodiscard]] Result<void> check_state_folders(const HostConfig& host);
/// Whether something can be kept in them: none is a plain file, or a link to nothing. The manager starts
/// without, and complains.
[[nodiscard]] Result<void> check_state_is_kept(const HostConfig& host);

/// Takes all rights to a folder from all other users. Makes it if it is not there; the folder above must be.
[[nodiscard]] Result<void> keep_folder(const std::string& path);

}  // namespace plchost
