#include "api/server/manager_link.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "api/dds/sample_identity.hpp"

namespace plchost {

Result<ManagerLink> ManagerLink::connect(const std::string& run_directory) {
  PLCHOST_TRY_ASSIGN(auto socket, in_step("cannot reach the manager",
                                          PacketSocket::connect(run_directory + "/manager.sock")));
  return ManagerLink(std::move(socket));
}

Result<void> ManagerLink::send(ControlRequest request, PendingCommand command) {
  const auto of_client = std::ranges::count_if(
      pending_, [&](const auto& entry) { return entry.second.client == command.client; });
  if (pending_.size() >= kMaxPending || static_cast<std::size_t>(of_client) >= kMaxPendingOfClient) {
    return failure(ErrorCode::busy,
                   fmt::format("{} commands are under way ({} of this client); at most {} ({})",
                               pending_.size(), of_client, kMaxPending, kMaxPendingOfClient));
  }
  request.number = next_number_++;
  PLCHOST_TRY(in_step("cannot pass the command to the manager", socket_.send(encode(request))));
  pending_.emplace(request.number, std::move(command));
  return {};
}

bool ManagerLink::is_pending(const plc_SampleIdentity& identity) const {
  return std::ranges::any_of(
      pending_, [&](const auto& entry) { return same_identity(entry.second.identity, identity); });
}

Result<std::vector<FinishedCommand>> ManagerLink::receive() {
  std::vector<FinishedCommand> finished;
  for (;;) {
    PLCHOST_TRY_ASSIGN(auto packet, socket_.receive());
    if (!packet) return finished;
    PLCHOST_TRY_ASSIGN(auto reply, decode_reply(*packet));
    const auto found = pending_.find(reply.number);
    if (found == pending_.end()) continue;  // came after its time limit
    finished.push_back({std::move(found->second), reply.code, std::move(reply.text)});
    pending_.erase(found);
  }
}

std::vector<FinishedCommand> ManagerLink::expire(TimePoint now) {
  std::vector<FinishedCommand> late;
  for (auto it = pending_.begin(); it != pending_.end();) {
    if (it->second.deadline > now) {
      ++it;
      continue;
    }
    late.push_back({std::move(it->second), ErrorCode::timed_out, "the manager has not answered in time"});
    it = pending_.erase(it);
  }
  return late;
}

}  // namespace plchost
