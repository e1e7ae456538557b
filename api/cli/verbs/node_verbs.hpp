#pragma once

#include "api/cli/cli_session.hpp"

namespace plchost {

/// "list nodes" and "show routes", below their verbs.
void add_list_nodes(const Command& verb, CliSession& session);
void add_show_routes(const Command& verb, CliSession& session);

}  // namespace plchost
