#include "api/cli/host_selection.hpp"

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <utility>

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

// The next host that nobody has asked yet, until none is left.
Async<bool> ask_next(ClientCore& core, std::vector<HostOutcome>& outcomes, std::size_t& next,
                     const HostCall& call) {
  while (next < outcomes.size()) {
    HostOutcome& outcome = outcomes[next++];
    outcome.reply = co_await call(core, outcome.host);
  }
  core.pump().look_again();
  co_return true;
}

Async<bool> ask_all(ClientCore& core, std::vector<HostOutcome>& outcomes, const HostCall& call) {
  constexpr std::size_t kAtOnce = 16;
  std::size_t next = 0;
  std::vector<Async<bool>> askers;
  for (std::size_t i = 0; i < kAtOnce; ++i) {
    askers.push_back(ask_next(core, outcomes, next, call));
    askers.back().start();
  }
  for (const Async<bool>& asker : askers) {
    while (!asker.done()) co_await core.pump().change(kNoDeadline);
  }
  co_return true;
}

}  // namespace

std::vector<HostOutcome> ask_each(ControlClient& client, const std::vector<std::string>& hosts,
                                  const HostCall& call) {
  std::vector<HostOutcome> outcomes;
  for (const std::string& host : hosts) {
    outcomes.push_back({.host = host, .reply = failure(ErrorCode::timed_out, "not asked")});
  }
  (void)client.wait(ask_all(client.core(), outcomes, call));
  return outcomes;
}

}  // namespace plchost
