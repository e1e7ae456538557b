#include "api/audit/audit_writer.hpp"

#include <algorithm>
#include <utility>

#include "shm/base/names.hpp"
#include "shm/log/log.hpp"

namespace plchost {

AuditWriter::AuditWriter(Open open, std::function<void()> on_written)
    : open_(std::move(open)), on_written_(std::move(on_written)), at_disk_(MonotonicClock::now()) {
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
  (void)hand_in({.kind = Kind::add_pending, .key = std::move(key), .record = std::move(record)});
}

void AuditWriter::remove_pending(std::string key) {
  (void)hand_in({.kind = Kind::remove_pending, .key = std::move(key)});
}

void AuditWriter::flush() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return is_written(last_ticket_); });
}

AuditHead AuditWriter::head() const {
  const std::lock_guard lock(mutex_);
  return head_;
}

std::string AuditWriter::problem(TimePoint now) const {
  const std::lock_guard lock(mutex_);
  if (!failure_.empty()) return failure_;
  if (head_.number > 0 && !at_disk_) {  // it was opened before, and stays so
    if (auto unsynced = logs_.done->sync_problem(); !unsynced.empty()) return unsynced;
  }
  if (!at_disk_ || now - *at_disk_ < kSlow) return {};
  return head_.number == 0 ? "the disk does not answer; the log is not open yet, changes wait in memory"
                           : "the disk does not answer; changes wait in memory";
}

bool AuditWriter::open() {
  for (;;) {
    auto logs = open_();
    if (!logs) {
      if (!wait_to_open_again(logs.error())) return false;
      continue;
    }
    logs_ = *std::move(logs);
    const std::lock_guard lock(mutex_);
    head_ = logs_.done->head();
    failure_.clear();
    at_disk_.reset();
    cannot_open_ = false;
    return true;
  }
}

// A process that ends lets go of the log, so the records wait for it. Nothing waits for any other error.
bool AuditWriter::wait_to_open_again(const Error& error) {
  std::unique_lock lock(mutex_);
  failure_ = error.describe();
  at_disk_.reset();
  cannot_open_ = ending_ || error.code != ErrorCode::busy;
  changed_.notify_all();
  lock.unlock();
  if (on_written_) on_written_();
  lock.lock();
  if (!changed_.wait_for(lock, kRetry, [this] { return ending_; })) {
    at_disk_ = MonotonicClock::now();
    return true;
  }
  const auto is_record = [](const Job& job) { return job.kind == Kind::done || job.kind == Kind::refused; };
  const auto lost = dropped_ + static_cast<std::uint64_t>(std::ranges::count_if(jobs_, is_record));
  if (lost > 0) {
    spdlog::error("{} lost: {}", count_text(lost, "record of a change is", "records of changes are"),
                  failure_);
  }
  return false;
}

void AuditWriter::work() {
  if (!open()) return;
  for (;;) {
    std::deque<Job> jobs;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return ending_ || !jobs_.empty(); });
      if (jobs_.empty()) return;
      jobs = std::exchange(jobs_, {});
      at_disk_ = MonotonicClock::now();
    }
    write_all(jobs);
  }
}

void AuditWriter::write_all(const std::deque<Job>& jobs) {
  for (const Job& job : jobs) do_job(job);
  tell_of_dropped();
  {
    const std::lock_guard lock(mutex_);
    head_ = logs_.done->head();
    written_ = jobs.back().ticket;
    at_disk_.reset();
  }
  changed_.notify_all();
  if (on_written_) on_written_();
}

void AuditWriter::do_job(const Job& job) {
  switch (job.kind) {
    case Kind::done:
      return append(*logs_.done, job.record);
    case Kind::refused:
      return append(logs_.refused ? *logs_.refused : *logs_.done, job.record);
    case Kind::add_pending:
      if (!logs_.pending) return;
      if (const auto added = logs_.pending->add(job.key, job.record); !added) {
        spdlog::error("commands under way are not recorded: {}", added.error().describe());
      }
      return;
    case Kind::remove_pending:
      if (logs_.pending) logs_.pending->remove(job.key);
      return;
  }
}

void AuditWriter::append(AuditLog& log, const AuditRecord& record) {
  const auto written = log.append(record);
  const std::lock_guard lock(mutex_);
  failure_ = written ? "" : written.error().describe();
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
