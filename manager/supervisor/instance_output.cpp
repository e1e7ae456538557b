#include "manager/supervisor/instance_output.hpp"

#include <algorithm>
#include <array>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include "manager/system/child_process.hpp"
#include "shm/base/names.hpp"
#include "shm/base/system_call.hpp"
#include "shm/base/time.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

bool takes_more(int fd) noexcept {
  pollfd poll{.fd = fd, .events = POLLOUT, .revents = 0};
  return ::poll(&poll, 1, 0) == 1 && (poll.revents & POLLOUT) != 0;
}

// Each by its own open(): an application may change the flags of its standard output.
Result<UniqueFd> open_end(const std::string& path, int flags) {
  UniqueFd fd(::open(path.c_str(), flags | O_NONBLOCK | O_CLOEXEC | O_NOFOLLOW));  // NOLINT: variadic
  PLCHOST_TRY(check_errno(fd.get(), "cannot open " + path));
  struct stat status{};
  PLCHOST_TRY(check_errno(::fstat(fd.get(), &status), "cannot examine " + path));
  if (!S_ISFIFO(status.st_mode)) return failure(ErrorCode::wrong_type, path + " is no pipe");
  return fd;
}

}  // namespace

Result<void> InstanceOutput::open_ends() {
  PLCHOST_TRY_ASSIGN(auto read_end, open_end(path(), O_RDONLY));
  PLCHOST_TRY_ASSIGN(auto write_end, open_end(path(), O_WRONLY));
  read_end_ = std::move(read_end);
  write_end_ = std::move(write_end);
  // Refused to a user who has many pipes: then it keeps as much as other pipes do.
  (void)::fcntl(read_end_.get(), F_SETPIPE_SZ, kPipeBytes);  // NOLINT: variadic
  return {};
}

Result<UniqueFd> InstanceOutput::open_for_process() {
  last_line_.clear();
  if (!read_end_) {
    ::unlink(path().c_str());
    constexpr mode_t kOwnerOnly = 0600;
    PLCHOST_TRY(check_errno(::mkfifo(path().c_str(), kOwnerOnly), "cannot create the pipe " + path()));
    PLCHOST_TRY(open_ends());
  }
  // To read, too: so the pipe outlives the manager.
  return open_end(path(), O_RDWR);
}

void InstanceOutput::adopt() {
  if (read_end_) return;
  if (const auto opened = open_ends(); !opened) {
    spdlog::warn("instance {}: its output is not read: {}", settings_.instance, opened.error().describe());
  }
}

void InstanceOutput::read(std::int32_t pid) {
  if (!read_end_) return;
  const bool full = !takes_more(write_end_.get());
  if (read_at_most(kReadAtOnce, pid) > 0 && full) {
    say(LogLevel::warning, pid, "lines are missing here: it said more than was read in time");
  }
}

void InstanceOutput::end(std::int32_t pid) {
  if (!read_end_) return;
  (void)read_at_most(kPipeBytes, pid);
  lines_.end(pid, unix_time_ns(), [this](const LogEntry& entry) { take(entry); });
}

std::size_t InstanceOutput::read_at_most(std::size_t most, std::int32_t pid) {
  const std::string bytes = read_available(read_end_.get(), most);
  if (bytes.empty()) return 0;
  forward(bytes);
  lines_.add(bytes, pid, unix_time_ns(), [this](const LogEntry& entry) { take(entry); });
  return bytes.size();
}

void InstanceOutput::say(LogLevel level, std::int32_t pid, std::string_view text) {
  keep({.time_unix_ns = unix_time_ns(),
        .pid = pid,
        .level = level,
        .source = LogSource::manager,
        .text = text});
}

void InstanceOutput::take(const LogEntry& entry) {
  last_line_ = cut_front(entry.text, kLastLine);  // the cause stands at its end
  keep(entry);
}

void InstanceOutput::keep(const LogEntry& entry) {
  if (!ring_ && !ring_failed_) {
    auto ring = LogRing::open(settings_.pool, settings_.instance);
    if (ring) {
      ring_ = *std::move(ring);
    } else {
      ring_failed_ = true;
      spdlog::warn("instance {}: its output is not kept: {}", settings_.instance, ring.error().describe());
    }
  }
  if (ring_) ring_->add(entry);
}

// Onto standard error, where the log of the manager goes; never waits for its reader.
void InstanceOutput::forward(std::string_view bytes) {
  while (!bytes.empty() && takes_more(STDERR_FILENO)) {
    // So much fits into a pipe that takes anything.
    constexpr std::size_t kAtOnce = 4096;
    const ssize_t written = ::write(STDERR_FILENO, bytes.data(), std::min(bytes.size(), kAtOnce));
    if (written <= 0) break;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  not_forwarded_ += bytes.size();
  if (not_forwarded_ == 0 || !bytes.empty()) return;
  spdlog::warn("instance {0}: {1} bytes of output were dropped from this log; 'plcctl logs {0}' has them",
               settings_.instance, std::exchange(not_forwarded_, 0));
}

}  // namespace plchost
