#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "api/cli/rows/table.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// The last `most` records of the audit log in the folder that are about the instance or the whole host, the
/// oldest first, of the newest MiB of it. A record of a variable has its name and not its value. system: the
/// caller may not read the folder, or a file there.
[[nodiscard]] Result<std::vector<Row>> audit_tail(const std::string& folder, const std::string& instance,
                                                  std::size_t most);

}  // namespace plchost
