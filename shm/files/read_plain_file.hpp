#pragma once

#include <cstddef>
#include <string>

#include "shm/base/result.hpp"

namespace plchost {

/// The contents of a file in a folder that other users write, too: they may put anything there. Follows no
/// link, waits for nothing. not_found: there is none. wrong_type: a link, no plain file, or one of several
/// names. corrupt: more than `most` bytes. system: it cannot be read. Set-up.
[[nodiscard]] Result<std::string> read_plain_file(const std::string& path, std::size_t most);

}  // namespace plchost
