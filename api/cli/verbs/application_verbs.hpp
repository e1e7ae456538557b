#pragma once

#include "api/cli/cli_session.hpp"

namespace plchost {

/// "load application" and "rollback application".
void add_application_verbs(const Command& plcctl, CliSession& session);
/// "list applications", below its verb.
void add_list_applications(const Command& verb, CliSession& session);

}  // namespace plchost
