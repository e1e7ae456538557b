#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "api/audit/audit_record.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// Requests without an answer yet, each in a small file of its own beside the audit log, so that the next
/// process can record it if this one is killed. Not in the chain: it is there for as long as a command takes.
class PendingRecords {
 public:
  /// `folder` is made if it is not there, for its owner only.
  [[nodiscard]] static Result<PendingRecords> open(std::string folder);

  /// `key`: letters, digits, '.', '-', '_'. A file that cannot be written is an error, and nothing else.
  Result<void> add(std::string_view key, const AuditRecord& record) const;
  void remove(std::string_view key) const;
  /// The records that the process before has left, by key; a file that is no record is left out. All are gone
  /// afterwards.
  [[nodiscard]] std::vector<AuditRecord> take_all() const;

 private:
  explicit PendingRecords(std::string folder) noexcept : folder_(std::move(folder)) {}
  [[nodiscard]] std::string path_of(std::string_view key) const;

  std::string folder_;
};

}  // namespace plchost
