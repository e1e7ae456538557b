#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "api/audit/audit_log.hpp"
#include "api/audit/pending_records.hpp"

namespace plchost {

/// Where records go.
struct AuditLogs {
  std::unique_ptr<AuditLog> done;         ///< null: nothing is recorded
  std::unique_ptr<AuditLog> refused;      ///< a quota of its own; null: refusals go to `done`
  std::optional<PendingRecords> pending;  ///< what is under way
};

/// Writes the audit log on a thread of its own, because a disk may take any time: whoever hands in a record
/// never waits. In the order in which they come. Of more than kMost records that wait, the new ones are
/// counted and the log tells how many are missing. All but the destructor: any thread.
class AuditWriter {
 public:
  static constexpr std::size_t kMost = 4096;
  /// Of a record that was handed in; 0: there is nothing to wait for.
  using Ticket = std::uint64_t;

  /// `on_written` is called on the writing thread whenever is_written() may have changed. `logs.done` is
  /// there.
  AuditWriter(AuditLogs logs, std::function<void()> on_written);
  AuditWriter(const AuditWriter&) = delete;
  AuditWriter& operator=(const AuditWriter&) = delete;
  /// Waits until all is written.
  ~AuditWriter();

  Ticket write(AuditRecord record);
  Ticket write_refused(AuditRecord record);
  void add_pending(std::string key, AuditRecord record);
  void remove_pending(std::string key);

  /// Also when it could not be written: the log tells that itself.
  [[nodiscard]] bool is_written(Ticket ticket) const noexcept { return written_ >= ticket; }
  /// Waits until all that was handed in is written.
  void flush();
  /// The last record of the log of what was done.
  [[nodiscard]] AuditHead head() const;

 private:
  enum class Kind : std::uint8_t { done, refused, add_pending, remove_pending };
  struct Job {
    Kind kind = Kind::done;
    Ticket ticket = 0;
    std::string key = {};
    AuditRecord record = {};
  };
  Ticket hand_in(Job job);
  void work();
  void do_job(const Job& job);
  void append(AuditLog& log, const AuditRecord& record);
  void tell_of_dropped();

  AuditLogs logs_;
  std::function<void()> on_written_;
  std::atomic<Ticket> written_{0};
  bool failing_ = false;  // of the writing thread
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;       // guarded by mutex_, as what follows
  std::uint64_t dropped_ = 0;  // records, since the log was told
  Ticket last_ticket_ = 0;
  bool ending_ = false;
  AuditHead head_;
  std::thread thread_;
};

}  // namespace plchost
