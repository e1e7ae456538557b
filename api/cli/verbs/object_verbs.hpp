#pragma once

#include "api/cli/cli_session.hpp"

namespace plchost {

/// "list objects", "show object" and "watch object", below their verbs.
void add_list_objects(const Command& verb, CliSession& session);
void add_show_object(const Command& verb, CliSession& session);
void add_watch_object(const Command& verb, CliSession& session);

}  // namespace plchost
