#include "api/library/calls.hpp"

#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "api/client/check_names.hpp"
#include "shm/base/names.hpp"

namespace plchost {

Result<EventId> event_of(const std::string& name) {
  PLCHOST_TRY_ASSIGN(auto parts, split_name("EVENT", name));
  return EventId{std::move(parts.first), std::move(parts.second)};
}

Result<std::string> host_of(ControlClient& client, const std::string& name, TimePoint deadline) {
  if (!name.empty()) {
    PLCHOST_TRY_ASSIGN(auto found, client.host(name, deadline));
    return std::move(found.name);
  }
  if (!client.only().empty()) return host_of(client, client.only(), deadline);
  const auto all = client.hosts(deadline);
  if (all.size() == 1) return all.front().name;
  if (all.empty()) return failure(ErrorCode::unavailable, "no host answers");
  std::vector<std::string_view> names;
  for (const HostView& host : all) names.emplace_back(host.name);
  return failure(ErrorCode::invalid_argument,
                 fmt::format("several hosts answer, and none was named: {}", join_names(names)));
}

}  // namespace plchost
