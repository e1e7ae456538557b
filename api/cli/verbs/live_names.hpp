#pragma once

#include <string_view>
#include <vector>

#include "api/cli/cli_session.hpp"
#include "api/cli/words/completion.hpp"

namespace plchost {

/// The present values of that form (Completion::value), of the hosts that are shown. Nothing: nobody answers,
/// or values of that form have no names.
[[nodiscard]] std::vector<Candidate> live_names(CliSession& session, std::string_view form);

}  // namespace plchost
