#pragma once

#include <string>
#include <string_view>

#include <sys/types.h>

#include "shm/base/result.hpp"

namespace plchost {

/// Gives the file at `path` the contents `text`, all or nothing: a reader sees the old contents or the new
/// ones, also after a loss of power. Makes the file if there is none. `mode`: its permission bits, of which
/// umask may take some; it never has others, not even while it is written. system: why it stays as it was.
/// Set-up.
[[nodiscard]] Result<void> replace_file(const std::string& path, std::string_view text, mode_t mode = 0644);

/// Makes the file at `path` with the contents `text`, all of which are on the disk when it returns well. A
/// left-over of that name is removed. `mode` as above. system: why there is none, or half a one. Set-up.
[[nodiscard]] Result<void> write_whole_file(const std::string& path, std::string_view text, mode_t mode);

/// Makes the folder at `path`, unless it is there, and those above it that are missing. They are there for
/// good when it returns well, also after a loss of power. `mode`: the permission bits of the folder at
/// `path`, of which umask may take some; those above it have what umask leaves of 0777. system: why it is not
/// there. Set-up.
[[nodiscard]] Result<void> make_synced_folders(const std::string& path, mode_t mode);

/// The same for the folder at `path` alone; the one above it must be there. Set-up.
[[nodiscard]] Result<void> make_synced_folder(const std::string& path, mode_t mode);

/// Files that were made, renamed or removed in the folder are so for good when it returns, also after a loss
/// of power. Set-up.
[[nodiscard]] Result<void> sync_directory(const std::string& path);

}  // namespace plchost
