#pragma once

#include <cstddef>
#include <string>

#include "shm/base/result.hpp"

namespace plchost {

/// The error says what is wrong with the file.
[[nodiscard]] Result<void> check_readable_file(const std::string& path);

/// All of a file; an error if it has more than `most` bytes. Set-up.
[[nodiscard]] Result<std::string> read_config_text(const std::string& path, std::size_t most);

}  // namespace plchost
