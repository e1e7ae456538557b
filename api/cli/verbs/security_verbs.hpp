#pragma once

#include "api/cli/cli_session.hpp"

namespace plchost {

/// `plcctl security ...`: who may do what, as files. Speaks no DDS.
void add_security_verb(const Command& plcctl, CliSession& session);

}  // namespace plchost
