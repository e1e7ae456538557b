#pragma once

#include "api/cli/cli_session.hpp"

namespace plchost {

/// `plcctl security ...`: the rights of each client, as files. Speaks no DDS.
void add_security_verb(const Command& plcctl, CliSession& session);

}  // namespace plchost
