#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "api/audit/audit_logs.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// Opens and writes the audit log on a thread of its own, because a disk may take any time: the thread that
/// hands in a record never waits. In the order in which they come. Until the log is open, records wait as
/// they do for a slow disk. Of more than kMost records that wait, the new ones are counted and the log tells
/// how many are missing. All but the destructor: any thread.
class AuditWriter {
 public:
  static constexpr std::size_t kMost = 4096;
  /// A log that cannot be opened is tried again after so long.
  static constexpr Duration kRetry = std::chrono::milliseconds(100);
  /// A disk that has not answered for so long is a problem.
  static constexpr Duration kSlow = std::chrono::seconds(2);
  /// Of a record that was handed in; 0: there is nothing to wait for.
  using Ticket = std::uint64_t;

  using Open = std::function<Result<AuditLogs>()>;

  /// Both are called on the writing thread: `open` until it succeeds, `on_written` whenever is_written() may
  /// have changed.
  AuditWriter(Open open, std::function<void()> on_written);
  AuditWriter(const AuditWriter&) = delete;
  AuditWriter& operator=(const AuditWriter&) = delete;
  /// Waits until all is written. Records for a log that cannot be opened are lost, which is logged.
  ~AuditWriter();

  Ticket write(AuditRecord record);
  Ticket write_refused(AuditRecord record);
  void add_pending(std::string key, AuditRecord record);
  void remove_pending(std::string key);

  /// Also when it could not be written, which the log tells itself, and while the log cannot be opened: there
  /// is nothing to wait for.
  [[nodiscard]] bool is_written(Ticket ticket) const noexcept { return cannot_open_ || written_ >= ticket; }
  /// Waits until is_written() is true for all that was handed in.
  void flush();
  /// The last record of the log of what was done; number 0: the log is not open yet.
  [[nodiscard]] AuditHead head() const;
  /// Why records are not on the disk; empty: they are.
  [[nodiscard]] std::string problem(TimePoint now) const;

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
  [[nodiscard]] bool open();
  [[nodiscard]] bool wait_to_open_again(const Error& error);
  void write_all(const std::deque<Job>& jobs);
  void do_job(const Job& job);
  void append(AuditLog& log, const AuditRecord& record);
  void tell_of_dropped();

  Open open_;
  std::function<void()> on_written_;
  AuditLogs logs_;  // of the writing thread; not another one once head_ has a number
  std::atomic<Ticket> written_{0};
  std::atomic<bool> cannot_open_{false};
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;       // guarded by mutex_, as what follows
  std::uint64_t dropped_ = 0;  // records, since the log was told
  Ticket last_ticket_ = 0;
  bool ending_ = false;
  AuditHead head_;
  std::string failure_;               // of the last attempt to open or to write
  std::optional<TimePoint> at_disk_;  // since when the writing thread has been busy with it
  std::thread thread_;
};

}  // namespace plchost
