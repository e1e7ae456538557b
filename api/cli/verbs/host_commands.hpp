#pragma once

#include <string>

#include "api/cli/cli_session.hpp"

namespace plchost {

/// A stop may take 35 s, and a fresh process comes after one. Longer than the server waits for the manager,
/// so that its answer is heard.
inline constexpr Duration kLongCommand = std::chrono::seconds(80);

/// Sends a command to the hosts that are meant and says what became of it at each; the exit code.
[[nodiscard]] int command(CliSession& session, const ApiRequest& request);

/// Asks those hosts and says what became of it at each; the exit code. `instance`: what is asked about.
[[nodiscard]] int ask_hosts(CliSession& session, const std::vector<std::string>& hosts,
                            const std::string& instance, const HostCall& call);

}  // namespace plchost
