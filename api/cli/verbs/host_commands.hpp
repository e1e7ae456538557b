#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "api/cli/cli_session.hpp"

namespace plchost {

/// The least time that a client waits for the answer, as least_wait() says it of plc_OPERATION_...
[[nodiscard]] Duration wait_for(std::int32_t operation);

/// Sends a command to the hosts that are meant and says what became of it at each; the exit code.
/// `done`: the word about the instance when it was done ("stopped").
[[nodiscard]] int command(CliSession& session, const ApiRequest& request, std::string_view done = "done");

/// The same for each instance of these names, one after the other. A name with '*' or '?' stands for all
/// instances that it matches, of the hosts that have them.
[[nodiscard]] int command_each(CliSession& session, const std::vector<std::string>& names,
                               const ApiRequest& request, std::string_view done);

/// Asks those hosts and says what became of it at each; the exit code. `instance`: the one that was asked
/// for.
[[nodiscard]] int ask_hosts(CliSession& session, const std::vector<std::string>& hosts,
                            const std::string& instance, const HostCall& call,
                            std::string_view done = "done");

struct NamedInstance {
  std::string name;
  std::vector<std::string> hosts;  ///< that have it; empty: not looked for
};
/// The instances that names and patterns ('*', '?') stand for, of the hosts that --host and --label select. A
/// name without '*' and '?' stays as it is. not_found: a pattern that matches none; lists those that there
/// are.
[[nodiscard]] Result<std::vector<NamedInstance>> expand(CliSession& session,
                                                        const std::vector<std::string>& names);

}  // namespace plchost
