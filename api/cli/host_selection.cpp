#include "api/cli/host_selection.hpp"

#include <algorithm>
#include <atomic>
#include <string_view>
#include <thread>
#include <utility>

#include "api/dds/object_query.hpp"

namespace plchost {

namespace {

constexpr std::string_view kAll = "all";

Result<ApiReply> ask_one(const std::shared_ptr<Participant>& participant, const std::string& host,
                         const HostCall& call) {
  PLCHOST_TRY_ASSIGN(const auto client, ControlClient::connect(participant, host));
  return call(*client, host);
}

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

std::vector<HostOutcome> ask_each(const std::shared_ptr<Participant>& participant,
                                  const std::vector<std::string>& hosts, const HostCall& call) {
  constexpr std::size_t kAtOnce = 16;
  std::vector<HostOutcome> outcomes;
  for (const std::string& host : hosts) {
    outcomes.push_back({.host = host, .reply = failure(ErrorCode::timed_out, "not asked")});
  }
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < outcomes.size(); i = next++) {
      outcomes[i].reply = ask_one(participant, outcomes[i].host, call);
    }
  };
  std::vector<std::jthread> threads;
  for (std::size_t i = 0; i < std::min(kAtOnce, outcomes.size()); ++i) threads.emplace_back(work);
  threads.clear();
  return outcomes;
}

}  // namespace plchost
