#pragma once

#include <string>
#include <string_view>

#include "shm/base/result.hpp"

namespace plchost {

/// Writes into a file by which the kernel takes orders, as in /proc or a control group: in one write, as the
/// kernel wants it. system: the file is not there, or the kernel refuses. Set-up.
[[nodiscard]] Result<void> write_kernel_file(const std::string& path, std::string_view text);

}  // namespace plchost
