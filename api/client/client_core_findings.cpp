#include <algorithm>

#include <fmt/format.h>

#include "api/client/client_core.hpp"
#include "api/client/client_core_status.hpp"

namespace plchost {

namespace {

// All of one check that was made after `round`.
bool is_complete(const std::vector<plc_HostFinding>& findings, std::uint64_t round) {
  if (findings.empty() || findings.size() != findings.front().finding_count) return false;
  return std::ranges::all_of(findings, [&](const plc_HostFinding& finding) {
    return finding.round > round && finding.round == findings.front().round;
  });
}

}  // namespace

Async<Result<std::vector<plc_HostFinding>>> ClientCore::check_host(std::string name, TimePoint deadline) {
  PLCHOST_CO_TRY(open_cache(host_findings_, dds::kHostFinding));
  PLCHOST_CO_TRY_ASSIGN(const auto before, co_await host(name, deadline));
  const ApiRequest request{name, plc_OPERATION_CHECK_HOST, "", ""};
  PLCHOST_CO_TRY_ASSIGN(const auto reply, co_await call(request, deadline));
  if (reply.code != ErrorCode::ok) co_return failure(reply.code, reply.text);
  for (;;) {
    if (const auto view = present(name)) {
      auto findings = host_findings_.of_host(name, view->epoch);
      // Another server counts its rounds anew.
      if (is_complete(findings, view->epoch == before.epoch ? before.status.round : 0)) {
        std::ranges::sort(findings, {}, &plc_HostFinding::position);
        co_return findings;
      }
    }
    if (MonotonicClock::now() >= deadline) break;
    co_await pump_->change(deadline);
  }
  co_return failure(ErrorCode::timed_out,
                    fmt::format("the findings of host '{}' have not come completely", name));
}

}  // namespace plchost
