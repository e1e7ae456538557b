#pragma once

#include <span>
#include <string>

#include <sys/types.h>

#include "shm/base/result.hpp"

namespace plchost {

/// Gives a file or folder the permission bits `mode`, and these users the bits `rights` (0 to 7) beside its
/// owner and its group, by an access list of POSIX. Without users it has no such list. The bits that stat()
/// shows for the group are then what users and group have together. unsupported: the file system takes no
/// such list, and the file has no fewer rights than before. refused: it is another user's. Set-up.
[[nodiscard]] Result<void> let_users(int fd, std::span<const uid_t> users, mode_t rights, mode_t mode,
                                     const std::string& path);

}  // namespace plchost
