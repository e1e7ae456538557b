#pragma once

#include "api/cli/cli_session.hpp"

namespace plchost {

/// "list hosts".
void add_list_hosts(const Command& list, CliSession& session);

}  // namespace plchost
