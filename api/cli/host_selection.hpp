#pragma once

#include <functional>
#include <string>
#include <vector>

#include "api/client/control_client.hpp"

namespace plchost {

/// Which hosts a command is for, as --host and --label say it.
struct HostSelection {
  std::string host;  ///< a name, a pattern ('*' any characters, '?' one), or "all"; empty: not said
  std::vector<std::string> labels;  ///< the host has all of these

  /// Whether several hosts are meant if several answer, and not one that has to be named.
  [[nodiscard]] bool means_many() const noexcept { return is_pattern() || !labels.empty(); }
  /// Whether it is that host, and no other one needs to be looked for.
  [[nodiscard]] bool names_one() const noexcept { return !host.empty() && !is_pattern(); }
  [[nodiscard]] bool selects(const HostView& view) const;

 private:
  [[nodiscard]] bool is_pattern() const noexcept;
};

/// The result of a command at one host.
struct HostOutcome {
  std::string host;
  Result<ApiReply> reply;
};
/// The command to one host.
using HostCall = std::function<Async<Result<ApiReply>>(ClientCore& core, const std::string& host)>;
/// Asks all hosts at the same time, 16 at most. In the order of the hosts.
[[nodiscard]] std::vector<HostOutcome> ask_each(ControlClient& client, const std::vector<std::string>& hosts,
                                                const HostCall& call);

}  // namespace plchost
