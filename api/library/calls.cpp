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

Async<Result<std::string>> host_of(ClientCore& core, std::string name, TimePoint deadline) {
  if (name.empty()) name = core.only();
  if (!name.empty()) {
    PLCHOST_CO_TRY_ASSIGN(auto found, co_await core.host(name, deadline));
    co_return std::move(found.name);
  }
  const auto all = co_await core.hosts(deadline);
  if (all.size() == 1) co_return all.front().name;
  if (all.empty()) co_return failure(ErrorCode::unavailable, "no host answers");
  std::vector<std::string_view> names;
  for (const HostView& host : all) names.emplace_back(host.name);
  co_return failure(ErrorCode::invalid_argument,
                    fmt::format("several hosts answer, and none was named: {}", join_names(names)));
}

}  // namespace plchost
