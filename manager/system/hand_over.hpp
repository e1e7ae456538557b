#pragma once

#include <optional>
#include <string>

#include <sys/stat.h>

#include "shm/base/result.hpp"
#include "shm/files/memory_rights.hpp"
#include "shm/process/user_account.hpp"

namespace plchost {

/// Nothing: it is not there, or no plain file of one name.
[[nodiscard]] std::optional<struct stat> plain_file(const std::string& path);

/// Gives a plain file of up to 32 MiB to a user, with the contents, the group and the permission bits that it
/// has. It does so by a new file, which takes the place of the old one when it is whole: the manager may give
/// no file away. Does nothing if there is no such file, or it is that user's. Waits for the disk.
[[nodiscard]] Result<void> hand_over(const std::string& path, const UserAccount& user);

/// The same where anybody can make files: one whose owner is not believed, and what is no plain file, is
/// taken away, with a line in the log. Does nothing if there is none.
[[nodiscard]] Result<void> hand_over_believed(const std::string& path, const UserAccount& user,
                                              const OwnerCheck& believed);

/// Failing because this process cannot open files as that user.
[[nodiscard]] std::unexpected<Error> no_rights_of(uid_t user);

}  // namespace plchost
