#pragma once

#include "api/cli/cli_session.hpp"

namespace plchost {

/// "list transitions" and "watch transitions", below their verbs.
void add_list_transitions(const Command& verb, CliSession& session);
void add_watch_transitions(const Command& verb, CliSession& session);

}  // namespace plchost
