#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "api/audit/audit_record.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// The result of the check of an audit log.
struct AuditFindings {
  std::uint64_t first = 0;  ///< number of the first record; above 1: the files before are gone. 0: none
  AuditHead head;           ///< the last one: compared with a note of it, it shows that nothing was cut off
  std::uint64_t records = 0;
  std::vector<std::string> problems;  ///< "FILE:LINE: ...": changed, missing, inserted. At most kMostProblems
  std::vector<std::string> remarks;   ///< where the log itself says that something is missing

  static constexpr std::size_t kMostProblems = 100;
};

/// The check from line to line; `findings` must outlive it.
class AuditWalk {
 public:
  explicit AuditWalk(AuditFindings& findings) : findings_(findings) {}
  /// The next line, without its newline. `where` is said of what is wrong in it.
  void take(const std::string& where, std::string_view line);
  /// There are no more.
  void end();

 private:
  void compare(const std::string& where, const AuditLink& link);
  void problem(const std::string& text);

  AuditFindings& findings_;
  std::vector<std::string> unexplained_;  // problems, unless the next record explains them
};

/// Goes through the whole chain. not_found: no log is in the folder. system: it cannot be read.
[[nodiscard]] Result<AuditFindings> check_audit(const std::string& folder);

}  // namespace plchost
