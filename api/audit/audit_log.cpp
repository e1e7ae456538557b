#include "api/audit/audit_log.hpp"

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <filesystem>
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
  if (dirty_) ::fdatasync(file_.get());
}

Result<std::unique_ptr<AuditLog>> AuditLog::open(Options options) {
  std::error_code error;
  if (std::filesystem::create_directories(options.folder, error)) {
    std::filesystem::permissions(options.folder, std::filesystem::perms::owner_all, error);
  }
  if (error) return failure(ErrorCode::system, "cannot create folder " + options.folder, error.value());
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
  const AuditFile& last = files.back();
  head_.number = last.first - 1;  // unless a record is found in it
  PLCHOST_TRY(open_file(last.path));
  return find_end(last.path);
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
  bytes_ = static_cast<std::size_t>(status.st_size);
  const std::lock_guard lock(guard_);
  file_ = std::move(fd);
  dirty_ = true;
  return {};
}

// The last record, and what a process that was killed has left half-written behind it.
Result<void> AuditLog::find_end(const std::string& path) {
  constexpr std::size_t kTail = std::size_t{64} << 10;  // many times a record
  std::string tail(std::min(bytes_, kTail), '\0');
  const auto begin = static_cast<off_t>(bytes_ - tail.size());
  const auto got = ::pread(file_.get(), tail.data(), tail.size(), begin);
  if (got < 0) return failure(ErrorCode::system, "cannot read " + path, errno);
  tail.resize(static_cast<std::size_t>(got));
  if (tail.empty()) return write(of_the_log("repair", "this file was empty"));
  if (tail.back() != '\n') {
    if (::write(file_.get(), "\n", 1) != 1) return failure(ErrorCode::system, "cannot write " + path, errno);
    ++bytes_;
    tail += '\n';
  }
  for (std::size_t end = tail.size() - 1;;) {  // of a line: its newline
    const std::size_t before = end == 0 ? std::string::npos : tail.rfind('\n', end - 1);
    const std::size_t begin_of_line = before + 1;  // npos + 1: the first one
    if (const auto link = read_link(std::string_view(tail).substr(begin_of_line, end - begin_of_line))) {
      head_ = {.number = link->number, .hash = link->hash};
      if (end == tail.size() - 1) return {};
      break;
    }
    if (before == std::string::npos) break;
    end = before;
  }
  return write(
      of_the_log("repair", fmt::format("the records before were not complete, or changed; goes on after "
                                       "record {}",
                                       head_.number)));
}

Result<void> AuditLog::next_file() {
  PLCHOST_TRY_ASSIGN(const auto files, audit_files(options_.folder));
  for (std::size_t i = 0; i + options_.most_files <= files.size(); ++i) ::unlink(files[i].path.c_str());
  return open_file(options_.folder + "/" + audit_file_name(head_.number + 1));
}

Result<void> AuditLog::write(const AuditRecord& record) {
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
    return write(record);
  };
  auto done = all();
  if (!done) ++missed_;
  return done;
}

// Beside the thread that appends: a disk may take long.
void AuditLog::sync_until_stopped(const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock waiting(mutex);
  while (!wake.wait_for(waiting, stop, kSyncPeriod, [&] { return stop.stop_requested(); })) {
    UniqueFd file;
    {
      const std::lock_guard lock(guard_);
      if (!std::exchange(dirty_, false)) continue;
      file.reset(::fcntl(file_.get(), F_DUPFD_CLOEXEC, 0));
    }
    ::fdatasync(file.get());
  }
}

}  // namespace plchost
