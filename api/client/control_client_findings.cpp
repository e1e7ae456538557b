#include <algorithm>

#include <fmt/format.h>

#include "api/client/control_client.hpp"
#include "api/client/control_client_status.hpp"

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

Result<std::vector<plc_HostFinding>> ControlClient::check_host(const std::string& name, TimePoint deadline) {
  PLCHOST_TRY(open_cache(host_findings_, dds::kHostFinding));
  PLCHOST_TRY_ASSIGN(const auto before, host(name, deadline));
  PLCHOST_TRY_ASSIGN(const auto reply, call({name, plc_OPERATION_CHECK_HOST, "", ""}, deadline));
  if (reply.code != ErrorCode::ok) return failure(reply.code, reply.text);
  for (;;) {
    update();
    if (const auto view = present(name)) {
      auto findings = host_findings_.of_host(name, view->epoch);
      // Another server counts its rounds anew.
      if (is_complete(findings, view->epoch == before.epoch ? before.status.round : 0)) {
        std::ranges::sort(findings, {}, &plc_HostFinding::position);
        return findings;
      }
    }
    if (MonotonicClock::now() >= deadline) break;
    wait_set_.wait(deadline);
  }
  return failure(ErrorCode::timed_out,
                 fmt::format("the findings of host '{}' have not come completely", name));
}

}  // namespace plchost
