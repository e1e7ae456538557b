#pragma once

#include "api/cli/cli_session.hpp"

namespace plchost {

/// "list transitions" and "watch transitions", below their verbs.
void add_list_transitions(CLI::App& verb, CliSession& session, Action& action);
void add_watch_transitions(CLI::App& verb, CliSession& session, Action& action);

}  // namespace plchost
