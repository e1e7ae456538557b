#pragma once

#include <string>
#include <string_view>

#include "shm/base/result.hpp"

namespace plchost {

/// Gives the file at `path` the contents `text`, all or nothing: who reads it sees the old contents or the
/// new ones, also after a loss of power. Makes the file if there is none. system: why it stays as it was.
/// Set-up.
[[nodiscard]] Result<void> replace_file(const std::string& path, std::string_view text);

/// What was made, renamed or removed in the folder is so for good when it returns, also after a loss of
/// power. Set-up.
[[nodiscard]] Result<void> sync_directory(const std::string& path);

}  // namespace plchost
