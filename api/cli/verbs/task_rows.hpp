#pragma once

#include <string>
#include <vector>

#include "api/cli/cli_session.hpp"

namespace plchost {

/// The tasks of the hosts that the session shows: of one instance, or of all if the name is empty. not_found:
/// no such instance on any of them.
[[nodiscard]] Result<std::vector<Row>> task_rows(CliSession& session, const std::string& instance);

}  // namespace plchost
