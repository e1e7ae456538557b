#include "api/cli/verbs/host_verbs.hpp"

#include <algorithm>
#include <optional>

#include "api/cli/rows/host_rows.hpp"

namespace plchost {

namespace {

// A host that does not answer that within a second is shown without it. So is one that this client may not
// ask.
std::optional<ClockOffset> clock_of(CliSession& session, const HostView& host) {
  constexpr Duration kPatience = std::chrono::seconds(1);
  if (host.silent) return std::nullopt;
  const auto client = session.client();
  if (!client) return std::nullopt;
  const auto clock =
      (*client)->clock_offset(host.name, std::min(session.deadline(), MonotonicClock::now() + kPatience));
  return clock ? std::optional(*clock) : std::nullopt;
}

int list_hosts(CliSession& session) {
  const auto hosts = session.known_hosts();
  if (!hosts) return CliSession::fail(hosts.error());
  std::vector<Row> rows;
  for (const HostView& host : *hosts) rows.push_back(to_row(host, clock_of(session, host)));
  return session.show(rows, columns_of<plc_HostStatus>());
}

}  // namespace

void add_list_hosts(const Command& list, CliSession& session) {
  list.noun("hosts", "The controllers of the DDS domain: state, load, clock",
            [&session] { return list_hosts(session); });
}

}  // namespace plchost
