#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "api/audit/audit_file.hpp"
#include "api/audit/audit_record.hpp"
#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

/// Each change and its client, in files that are only appended to. Each record carries the hash of the one
/// before, so that a change of any of them shows (see check_audit). A record survives, when append() has
/// returned, the end of this process. The disk gets it within kSyncPeriod: from then on it survives a loss of
/// power. If the disk reports an error, the records of this process since its last good sync are written
/// again. The kernel may have dropped them, and its next sync succeeds without them. If the first sync fails,
/// records of the process before may be missing, and a record `gap` says so. One thread; one log for each
/// folder.
class AuditLog {
 public:
  struct Options {
    /// Made if it is not there, for its owner only. A group that may write it may write its files.
    std::string folder;
    std::size_t file_bytes = std::size_t{16} << 20;  ///< then the next file is begun
    std::size_t most_files = 64;                     ///< then the oldest is removed
  };
  static constexpr auto kSyncPeriod = std::chrono::seconds(1);
  /// More bytes do not wait for a disk: append() fails.
  static constexpr std::size_t kMostUnsynced = std::size_t{4} << 20;

  /// Goes on where the log ends. busy: another process writes it. system: it cannot be written.
  [[nodiscard]] static Result<std::unique_ptr<AuditLog>> open(Options options);
  ~AuditLog();
  AuditLog(const AuditLog&) = delete;
  AuditLog& operator=(const AuditLog&) = delete;

  /// Writes one record. Records that cannot be written (a full disk) are counted, and the count is written as
  /// soon as something can be: until then the error is returned.
  Result<void> append(const AuditRecord& record);
  /// So many records were lost before they came here: the next one that can be written tells of them, too.
  void miss(std::uint64_t records) noexcept { missed_ += records; }
  [[nodiscard]] const AuditHead& head() const noexcept { return head_; }
  /// Why the disk has not taken the newest records for good; empty: it has, or is about to. Any thread.
  [[nodiscard]] std::string sync_problem() const;

 private:
  AuditLog(Options options, UniqueFd lock) noexcept;
  Result<void> go_on();
  Result<void> open_file(const std::string& path);
  Result<void> find_end(const std::vector<AuditFile>& files);
  Result<void> next_file();
  Result<void> write(const AuditRecord& record);
  /// All that append() has written is on the disk for good when it returns well.
  Result<void> sync();
  void take_error_before();
  void sync_until_stopped(const std::stop_token& stop);
  void tell_sync(const std::string& problem);

  Options options_;
  UniqueFd lock_;
  AuditHead head_;
  std::size_t bytes_ = 0;                   // of the file
  std::uint64_t missed_ = 0;                // records that could not be written
  std::atomic<bool> written_again_{false};  // and the log does not tell it yet
  std::atomic<bool> lost_before_{false};    // perhaps, of the process before; the log does not tell it yet
  std::mutex syncing_;                      // held as long as a sync lasts
  mutable std::mutex guard_;                // of what follows
  UniqueFd file_;
  std::string unsynced_;  // its end, as far as no sync has confirmed it
  std::size_t unsynced_at_ = 0;
  bool unsynced_before_ = false;  // bytes of the process before, of which no sync has told anything yet
  bool dirty_ = false;
  bool sync_failed_ = false;  // the last one: records that were written before it may be lost
  std::string sync_problem_;
  std::jthread syncer_;
};

}  // namespace plchost
