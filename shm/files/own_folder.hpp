#pragma once

#include <string>

#include "shm/base/result.hpp"

namespace plchost {

/// Whether what lies in a folder can be believed: it belongs to root or to the user of the process, and not
/// everybody may write it. refused: others can put files into it; the text says whose it is. not_found: there
/// is none. Set-up.
[[nodiscard]] Result<void> check_own_folder(const std::string& path);

}  // namespace plchost
