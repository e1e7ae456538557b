#include "api/cli/host_selection.hpp"

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <utility>

#include "api/cli/at_once.hpp"
#include "api/dds/object_query.hpp"

namespace plchost {

namespace {

constexpr std::string_view kAll = "all";

}  // namespace

bool HostSelection::is_pattern() const noexcept {
  return host == kAll || host.find_first_of("*?") != std::string::npos;
}

bool HostSelection::selects(const HostView& view) const {
  if (!host.empty() && host != kAll && !matches_pattern(host, view.name)) return false;
  const auto has = view.labels();
  return std::ranges::all_of(
      labels, [&](const std::string& label) { return std::ranges::find(has, label) != has.end(); });
}

namespace {

Async<bool> ask(ClientCore& core, HostOutcome& outcome, const HostCall& call) {
  outcome.reply = co_await call(core, outcome.host);
  co_return true;
}

}  // namespace

std::vector<HostOutcome> ask_each(ControlClient& client, const std::vector<std::string>& hosts,
                                  const HostCall& call) {
  std::vector<HostOutcome> outcomes;
  for (const std::string& host : hosts) {
    outcomes.push_back({.host = host, .reply = failure(ErrorCode::timed_out, "not asked")});
  }
  (void)client.wait(all_at_once(client.core().pump(), outcomes.size(),
                                [&](std::size_t i) { return ask(client.core(), outcomes[i], call); }));
  return outcomes;
}

}  // namespace plchost
