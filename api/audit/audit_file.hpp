#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "api/audit/audit_record.hpp"
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

/// How a file of the log ends.
struct AuditEnd {
  std::optional<AuditHead> head;   ///< of the last record that can be read; nothing: there is none
  bool head_is_last = true;        ///< nothing is behind it
  bool last_line_is_whole = true;  ///< it has its newline
};
/// system: it cannot be read.
[[nodiscard]] Result<AuditEnd> read_end(const std::string& path);

}  // namespace plchost
