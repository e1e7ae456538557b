#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "api/audit/audit_record.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// What was found in an audit log.
struct AuditFindings {
  std::uint64_t first = 0;  ///< number of the first record; above 1: the files before are gone. 0: none
  AuditHead head;           ///< the last one: who has noted it earlier knows that nothing was cut off
  std::uint64_t records = 0;
  std::vector<std::string> problems;  ///< "FILE:LINE: ...": changed, missing, inserted. At most kMostProblems
  std::vector<std::string> remarks;   ///< where the log itself says that something is missing

  static constexpr std::size_t kMostProblems = 100;
};

/// Goes through the whole chain. not_found: no log is in the folder. system: it cannot be read.
[[nodiscard]] Result<AuditFindings> check_audit(const std::string& folder);

}  // namespace plchost
