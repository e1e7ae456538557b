#include "api/audit/audit_logs.hpp"

#include <utility>

#include "shm/log/log.hpp"

namespace plchost {

Result<AuditLogs> AuditLogs::open(const std::string& folder) {
  constexpr std::size_t kRefusedFiles = 8;
  PLCHOST_TRY_ASSIGN(auto done, AuditLog::open({.folder = folder}));
  AuditLogs logs{.done = std::move(done), .refused = nullptr, .pending = {}};
  auto refused = AuditLog::open({.folder = folder + "/refused", .most_files = kRefusedFiles});
  auto pending = PendingRecords::open(folder + "/under_way");
  if (!refused) spdlog::error("refused requests are not recorded: {}", refused.error().describe());
  if (!pending) {
    spdlog::error("requests that a crash interrupts are not recorded: {}", pending.error().describe());
  }
  if (refused) logs.refused = *std::move(refused);
  if (pending) logs.pending = *std::move(pending);
  return logs;
}

}  // namespace plchost
