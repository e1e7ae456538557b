#include "api/audit/audit_writer.hpp"

#include <utility>

#include "shm/base/log.hpp"

namespace plchost {

AuditWriter::AuditWriter(AuditLogs logs, std::function<void()> on_written)
    : logs_(std::move(logs)), on_written_(std::move(on_written)), head_(logs_.done->head()) {
  thread_ = std::thread([this] { work(); });
}

AuditWriter::~AuditWriter() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

AuditWriter::Ticket AuditWriter::hand_in(Job job) {
  const std::lock_guard lock(mutex_);
  if (jobs_.size() >= kMost) {
    if (job.kind == Kind::done || job.kind == Kind::refused) ++dropped_;
    return 0;
  }
  job.ticket = ++last_ticket_;
  jobs_.push_back(std::move(job));
  changed_.notify_all();
  return last_ticket_;
}

AuditWriter::Ticket AuditWriter::write(AuditRecord record) {
  return hand_in({.kind = Kind::done, .record = std::move(record)});
}

AuditWriter::Ticket AuditWriter::write_refused(AuditRecord record) {
  return hand_in({.kind = Kind::refused, .record = std::move(record)});
}

void AuditWriter::add_pending(std::string key, AuditRecord record) {
  if (!logs_.pending) return;
  (void)hand_in({.kind = Kind::add_pending, .key = std::move(key), .record = std::move(record)});
}

void AuditWriter::remove_pending(std::string key) {
  if (logs_.pending) (void)hand_in({.kind = Kind::remove_pending, .key = std::move(key)});
}

void AuditWriter::flush() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return written_ >= last_ticket_; });
}

AuditHead AuditWriter::head() const {
  const std::lock_guard lock(mutex_);
  return head_;
}

void AuditWriter::work() {
  for (;;) {
    std::deque<Job> jobs;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return ending_ || !jobs_.empty(); });
      if (jobs_.empty()) return;
      jobs = std::exchange(jobs_, {});
    }
    for (const Job& job : jobs) do_job(job);
    tell_of_dropped();
    {
      const std::lock_guard lock(mutex_);
      head_ = logs_.done->head();
      written_ = jobs.back().ticket;
    }
    changed_.notify_all();
    if (on_written_) on_written_();
  }
}

void AuditWriter::do_job(const Job& job) {
  switch (job.kind) {
    case Kind::done:
      return append(*logs_.done, job.record);
    case Kind::refused:
      return append(logs_.refused ? *logs_.refused : *logs_.done, job.record);
    case Kind::add_pending:
      if (const auto added = logs_.pending->add(job.key, job.record); !added) {
        spdlog::error("what is under way is not recorded: {}", added.error().describe());
      }
      return;
    case Kind::remove_pending:
      return logs_.pending->remove(job.key);
  }
}

void AuditWriter::append(AuditLog& log, const AuditRecord& record) {
  const auto written = log.append(record);
  if (!written && !failing_) spdlog::error("changes are not recorded: {}", written.error().describe());
  if (written && failing_) spdlog::info("changes are recorded again");
  failing_ = !written;
}

// Which of the two logs they were for is not known any more.
void AuditWriter::tell_of_dropped() {
  std::uint64_t dropped = 0;
  {
    const std::lock_guard lock(mutex_);
    dropped = std::exchange(dropped_, 0);
  }
  if (dropped > 0) logs_.done->miss(dropped);
}

}  // namespace plchost
