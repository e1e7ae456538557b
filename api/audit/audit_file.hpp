#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "shm/base/result.hpp"

namespace plchost {

/// One file of an audit log, "audit.0000000001.log": named by the number of its first record, so that the
/// order of the names is that of the records.
struct AuditFile {
  std::string path;
  std::uint64_t first = 0;
};

[[nodiscard]] std::string audit_file_name(std::uint64_t first);
/// Those in the folder, in order. system: it cannot be read.
[[nodiscard]] Result<std::vector<AuditFile>> audit_files(const std::string& folder);

}  // namespace plchost
