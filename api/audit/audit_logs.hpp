#pragma once

#include <memory>
#include <optional>
#include <string>

#include "api/audit/audit_log.hpp"
#include "api/audit/pending_records.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// Where the records of a host go.
struct AuditLogs {
  /// Opens them in `folder`, `folder`/refused and `folder`/under_way. Takes as long as the disk takes.
  /// The last two are optional: an error of these is only logged. busy, system: as AuditLog::open().
  [[nodiscard]] static Result<AuditLogs> open(const std::string& folder);

  std::unique_ptr<AuditLog> done;         ///< never null
  std::unique_ptr<AuditLog> refused;      ///< a quota of its own; null: refusals go to `done`
  std::optional<PendingRecords> pending;  ///< commands under way
};

}  // namespace plchost
