#pragma once

#include <string>
#include <vector>

#include "api/cli/cli_session.hpp"

namespace plchost {

/// "list transitions" and "watch transitions", below their verbs.
void add_list_transitions(const Command& verb, CliSession& session);
void add_watch_transitions(const Command& verb, CliSession& session);

/// The changes of state of the instance that the selected hosts tell of, the oldest first; empty: of all.
[[nodiscard]] Result<std::vector<Row>> transition_rows(CliSession& session, const std::string& instance);

}  // namespace plchost
