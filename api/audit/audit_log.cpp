#include "api/audit/audit_log.hpp"

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <string_view>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "api/audit/audit_file.hpp"
#include "shm/base/names.hpp"
#include "shm/base/system_call.hpp"
#include "shm/base/time.hpp"
#include "shm/files/replace_file.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

// A folder can be locked as a file can; the kernel gives it back whatever ends this process.
Result<UniqueFd> lock_folder(const std::string& folder) {
  UniqueFd fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!fd) return failure(ErrorCode::system, "cannot open folder " + folder, errno);
  if (::flock(fd.get(), LOCK_EX | LOCK_NB) == 0) return fd;
  if (errno == EWOULDBLOCK)
    return failure(ErrorCode::busy, folder + " has a writer already: another process");
  return failure(ErrorCode::system, "cannot lock folder " + folder, errno);
}

// The next process that writes the log may have another user, which has the folder by its group.
mode_t mode_of_files(int folder) {
  constexpr mode_t kOwner = S_IRUSR | S_IWUSR;
  constexpr mode_t kGroup = S_IRGRP | S_IWGRP;
  struct stat status{};
  const bool group_writes = ::fstat(folder, &status) == 0 && (status.st_mode & S_IWGRP) != 0;
  return group_writes ? kOwner | kGroup : kOwner;
}

AuditRecord of_the_log(std::string what, std::string text) {
  AuditRecord record;
  record.time_unix_ns = unix_time_ns();
  record.what = std::move(what);
  record.result = "ok";
  record.text = std::move(text);
  return record;
}

}  // namespace

AuditLog::AuditLog(Options options, UniqueFd lock) noexcept
    : options_(std::move(options)), lock_(std::move(lock)) {}

AuditLog::~AuditLog() {
  syncer_ = {};
  if (const auto done = sync(); !done) tell_sync(done.error().describe());
}

Result<std::unique_ptr<AuditLog>> AuditLog::open(Options options) {
  PLCHOST_TRY(make_synced_folders(options.folder, S_IRWXU));
  PLCHOST_TRY_ASSIGN(auto lock, lock_folder(options.folder));
  std::unique_ptr<AuditLog> log(new AuditLog(std::move(options), std::move(lock)));
  PLCHOST_TRY(log->go_on());
  log->syncer_ =
      std::jthread([self = log.get()](const std::stop_token& stop) { self->sync_until_stopped(stop); });
  return log;
}

Result<void> AuditLog::go_on() {
  PLCHOST_TRY_ASSIGN(const auto files, audit_files(options_.folder));
  if (files.empty()) {
    PLCHOST_TRY(open_file(options_.folder + "/" + audit_file_name(1)));
    return write(of_the_log("begin", "the first record of this log"));
  }
  PLCHOST_TRY(open_file(files.back().path));
  return find_end(files);
}

Result<void> AuditLog::open_file(const std::string& path) {
  const mode_t mode = mode_of_files(lock_.get());
  UniqueFd fd(::open(path.c_str(), O_RDWR | O_APPEND | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, mode));
  const bool made = static_cast<bool>(fd);
  if (!made) fd.reset(::open(path.c_str(), O_RDWR | O_APPEND | O_CLOEXEC | O_NOFOLLOW));
  if (!fd) return failure(ErrorCode::system, "cannot open " + path, errno);
  if (made) PLCHOST_TRY(check_errno(::fchmod(fd.get(), mode), "cannot set the rights of " + path));
  struct stat status{};
  PLCHOST_TRY(check_errno(::fstat(fd.get(), &status), "cannot examine " + path));
  if (!S_ISREG(status.st_mode)) return failure(ErrorCode::wrong_type, path + " is no plain file");
  // Its name; also of one that a process has made that was killed then.
  PLCHOST_TRY(sync_directory(options_.folder));
  bytes_ = static_cast<std::size_t>(status.st_size);
  const std::lock_guard lock(guard_);
  file_ = std::move(fd);
  unsynced_.clear();
  unsynced_at_ = bytes_;
  unsynced_before_ = bytes_ > 0;
  dirty_ = true;
  return {};
}

// A process that was killed leaves half a record behind the last one. A power cut leaves any bytes there, or
// a file without a record.
Result<void> AuditLog::find_end(const std::vector<AuditFile>& files) {
  const std::string& path = files.back().path;
  PLCHOST_TRY_ASSIGN(AuditEnd end, read_end(path));
  if (!end.last_line_is_whole) {
    if (::write(file_.get(), "\n", 1) != 1) return failure(ErrorCode::system, "cannot write " + path, errno);
    ++bytes_;
    const std::lock_guard lock(guard_);
    unsynced_ += '\n';
  }
  const bool is_whole = end.head && end.head_is_last;
  for (auto file = files.rbegin() + 1; !end.head && file != files.rend(); ++file) {
    PLCHOST_TRY_ASSIGN(end, read_end(file->path));
  }
  head_ = end.head.value_or(AuditHead{.number = files.back().first - 1});
  if (is_whole) return {};
  return write(of_the_log(
      "repair", bytes_ == 0 ? "this file was empty"
                            : fmt::format("the records before were not complete, or changed; goes on after "
                                          "record {}",
                                          head_.number)));
}

// The records of a file are on the disk before another one begins: from then on nobody syncs it.
Result<void> AuditLog::next_file() {
  PLCHOST_TRY(sync());
  PLCHOST_TRY_ASSIGN(const auto files, audit_files(options_.folder));
  for (std::size_t i = 0; i + options_.most_files <= files.size(); ++i) ::unlink(files[i].path.c_str());
  return open_file(options_.folder + "/" + audit_file_name(head_.number + 1));
}

Result<void> AuditLog::write(const AuditRecord& record) {
  {
    const std::lock_guard lock(guard_);
    if (unsynced_.size() >= kMostUnsynced)
      return failure(ErrorCode::full, "the disk takes no records of the audit log in " + options_.folder);
  }
  AuditHead moved = head_;
  const std::string line = chain(record, moved);
  const auto written = ::write(file_.get(), line.data(), line.size());
  if (written != static_cast<ssize_t>(line.size())) {
    const int error = written < 0 ? errno : ENOSPC;
    // Half a record: nobody but this process writes, so it can be taken back.
    if (written > 0) (void)::ftruncate(file_.get(), static_cast<off_t>(bytes_));
    return failure(ErrorCode::system, "cannot write the audit log in " + options_.folder, error);
  }
  head_ = std::move(moved);
  bytes_ += line.size();
  const std::lock_guard lock(guard_);
  unsynced_ += line;
  dirty_ = true;
  return {};
}

Result<void> AuditLog::append(const AuditRecord& record) {
  const auto all = [&]() -> Result<void> {
    if (bytes_ >= options_.file_bytes) PLCHOST_TRY(next_file());
    if (missed_ > 0) {
      PLCHOST_TRY(write(of_the_log("gap", count_text(missed_, "record") + " could not be written")));
      missed_ = 0;
    }
    if (lost_before_) {
      PLCHOST_TRY(write(of_the_log(
          "gap", "the disk reported an error: records of the process before may be missing on it")));
      lost_before_ = false;
    }
    if (written_again_) {
      PLCHOST_TRY(write(of_the_log("disk",
                                   "the disk reported an error; the records of this process that it may have "
                                   "lost were written again")));
      written_again_ = false;
    }
    return write(record);
  };
  auto done = all();
  if (!done) ++missed_;
  return done;
}

// The log's own descriptor is told of each error, too. One from before the records are written again is none
// of the sync after that.
void AuditLog::take_error_before() {
  UniqueFd file;
  {
    const std::lock_guard lock(guard_);
    if (!sync_failed_) return;
    file.reset(::fcntl(file_.get(), F_DUPFD_CLOEXEC, 0));
  }
  (void)::fdatasync(file.get());
}

// Each error of the disk is told once: the sync after a failed one succeeds, though the kernel may have
// dropped what it could not write. So that is written again, before the next sync: this process has the bytes
// of its own records, and none of those of the process before.
Result<void> AuditLog::sync() {
  const std::lock_guard one(syncing_);
  const std::string failed = "cannot sync the audit log in " + options_.folder;
  take_error_before();
  UniqueFd file;
  std::string again;
  std::size_t confirmed = 0;
  std::size_t begin = 0;
  {
    const std::lock_guard lock(guard_);
    if (!std::exchange(dirty_, false)) return {};
    confirmed = unsynced_.size();
    begin = unsynced_at_;
    if (sync_failed_) again = unsynced_;
    file.reset(::fcntl(file_.get(), F_DUPFD_CLOEXEC, 0));
  }
  auto done = check_errno(file.get(), failed);
  if (done && !again.empty()) {
    // That of the log can only append. The same file, whatever has its name now; the disk may let open()
    // wait.
    file.reset(::open(fmt::format("/proc/self/fd/{}", file.get()).c_str(), O_WRONLY | O_CLOEXEC));
    done = check_errno(file.get(), failed);
  }
  for (std::size_t at = 0; done && at < again.size();) {
    const auto written =
        ::pwrite(file.get(), again.data() + at, again.size() - at, static_cast<off_t>(begin + at));
    done = check_errno(static_cast<int>(written), failed);
    if (done) at += static_cast<std::size_t>(written);
  }
  if (done) done = check_errno(::fdatasync(file.get()), failed);
  const std::lock_guard lock(guard_);
  dirty_ = dirty_ || !done;
  sync_failed_ = !done;
  // One error is enough: this process does not have those bytes.
  if (std::exchange(unsynced_before_, false) && !done) lost_before_ = true;
  if (!done) return std::unexpected(done.error());
  unsynced_.erase(0, confirmed);
  unsynced_at_ += confirmed;
  if (!again.empty()) written_again_ = true;
  return {};
}

// Beside the thread that appends: a disk may take long.
void AuditLog::sync_until_stopped(const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock waiting(mutex);
  while (!wake.wait_for(waiting, stop, kSyncPeriod, [&] { return stop.stop_requested(); })) {
    const auto done = sync();
    tell_sync(done ? "" : done.error().describe());
  }
}

void AuditLog::tell_sync(const std::string& problem) {
  {
    const std::lock_guard lock(guard_);
    if (std::exchange(sync_problem_, problem) == problem) return;
  }
  if (problem.empty()) {
    spdlog::info(
        "the audit log in {} reaches the disk again; the records of this process since the last good sync "
        "were written again",
        options_.folder);
  } else {
    spdlog::error("records of the audit log may not survive a loss of power: {}", problem);
  }
}

std::string AuditLog::sync_problem() const {
  const std::lock_guard lock(guard_);
  return sync_problem_;
}

}  // namespace plchost
