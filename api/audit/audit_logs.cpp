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
  for (const Error* error : {refused ? nullptr : &refused.error(), pending ? nullptr : &pending.error()}) {
    if (error != nullptr) spdlog::error("a part of what happens is not recorded: {}", error->describe());
  }
  if (refused) logs.refused = *std::move(refused);
  if (pending) logs.pending = *std::move(pending);
  return logs;
}

}  // namespace plchost
