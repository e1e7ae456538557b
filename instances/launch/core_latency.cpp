#include "instances/launch/core_latency.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/base/time.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

constexpr std::string_view kNoLatency = "n/a";
constexpr std::string_view kRecordPrefix = "core";
constexpr std::string_view kRecordSuffix = ".latency";
constexpr Duration kPatience = std::chrono::seconds(1);

std::string latency_file(const std::string& sysfs, int core) {
  return fmt::format("{}/devices/system/cpu/cpu{}/power/pm_qos_resume_latency_us", sysfs, core);
}

std::string record_path(const std::string& run_directory, int core) {
  return fmt::format("{}/{}{}{}", run_directory, kRecordPrefix, core, kRecordSuffix);
}

// The core whose record has this name; nothing: not a record.
std::optional<int> core_of_record(std::string_view name) {
  if (!name.starts_with(kRecordPrefix) || !name.ends_with(kRecordSuffix)) return std::nullopt;
  const std::string_view number = name.substr(
      kRecordPrefix.size(), name.size() - std::min(name.size(), kRecordPrefix.size() + kRecordSuffix.size()));
  int core = -1;
  const auto [stopped, error] = std::from_chars(number.data(), number.data() + number.size(), core);
  const bool whole = error == std::errc() && stopped == number.data() + number.size() && core >= 0;
  return whole ? std::optional(core) : std::nullopt;
}

// Its text is written into the kernel's file. Where instances have a user of their own, that user can
// make files in the run directory, too.
bool is_own_or_roots(int record) {
  struct stat status{};
  return ::fstat(record, &status) == 0 && S_ISREG(status.st_mode) &&
         (status.st_uid == 0 || status.st_uid == ::geteuid());
}

// The valid contents of the file: "n/a" or microseconds.
bool is_latency(std::string_view text) {
  int value = -1;
  const auto [stopped, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return text == kNoLatency || (error == std::errc() && stopped == text.data() + text.size() && value >= 0);
}

Result<std::string> read_text(int fd, const std::string& path) {
  std::array<char, 32> buffer{};
  PLCHOST_TRY_ASSIGN(const auto length,
                     check_errno(::pread(fd, buffer.data(), buffer.size(), 0), "cannot read " + path));
  std::string text(buffer.data(), static_cast<std::size_t>(length));
  while (text.ends_with('\n')) text.pop_back();
  return text;
}

Result<std::string> read_latency(const std::string& path) {
  const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!fd) {
    const int error = errno;
    return failure(error == ENOENT ? ErrorCode::unsupported : ErrorCode::refused, "cannot open " + path,
                   error);
  }
  auto text = read_text(fd.get(), path);
  if (text && !is_latency(*text)) {
    return failure(ErrorCode::unsupported,
                   fmt::format("{} holds '{}', neither n/a nor a number", path, *text));
  }
  return text;
}

Result<void> write_latency(const std::string& path, std::string_view value) {
  const UniqueFd fd(::open(path.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC));
  if (!fd) return failure(ErrorCode::refused, "cannot open " + path, errno);
  PLCHOST_TRY(check_errno(::write(fd.get(), value.data(), value.size()), "cannot write " + path));
  return {};
}

// One process at a time takes, gives back or tidies up. Held for some microseconds.
Result<UniqueFd> enter(const std::string& run_directory) {
  UniqueFd fd(::open(run_directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!fd) return failure(ErrorCode::refused, "cannot open " + run_directory, errno);
  if (::flock(fd.get(), LOCK_EX | LOCK_NB) == 0) return fd;
  if (errno == EWOULDBLOCK) {
    return failure(ErrorCode::busy, fmt::format("another process works on the records in {}", run_directory));
  }
  return failure(ErrorCode::system, "cannot lock " + run_directory, errno);
}

Result<UniqueFd> enter_soon(const std::string& run_directory) {
  const TimePoint end = MonotonicClock::now() + kPatience;
  for (;;) {
    auto entered = enter(run_directory);
    if (entered || entered.error().code != ErrorCode::busy || MonotonicClock::now() >= end) return entered;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

// For a record that nobody else has: puts its value back and removes it. Returns what was done.
std::string restore(const std::string& sysfs, const std::string& run_directory, int core, int record) {
  const std::string path = record_path(run_directory, core);
  const std::string file = latency_file(sysfs, core);
  const auto before = read_text(record, path);
  std::string done;
  if (before && is_latency(*before)) {
    const auto written = write_latency(file, *before);
    done = written ? fmt::format("core {}: its wake-up latency limit is {} again", core, *before)
                   : fmt::format("core {}: its wake-up latency limit is not put back to {}: {}", core,
                                 *before, written.error().describe());
    // Kept for somebody with the right to write it.
    if (!written) return done;
  } else if (!before || !before->empty()) {
    done = fmt::format("core {}: the former value of {} is not known: {} is spoilt", core, file, path);
  }  // An empty record was begun, and nothing was changed yet.
  ::unlink(path.c_str());
  return done;
}

// The record with the value from before in it: a new one, or the one of holders that are there or gone.
Result<UniqueFd> make_record(const std::string& run_directory, int core, const std::string& before) {
  const std::string path = record_path(run_directory, core);
  constexpr mode_t kMode = 0640;
  UniqueFd record(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, kMode));
  if (!record) return failure(ErrorCode::refused, "cannot open " + path, errno);
  if (!is_own_or_roots(record.get()))
    return failure(ErrorCode::refused, path + " was put there by another user: remove it");
  PLCHOST_TRY_ASSIGN(const auto kept, read_text(record.get(), path));
  if (!is_latency(kept)) {
    if (::ftruncate(record.get(), 0) != 0 ||
        ::pwrite(record.get(), before.data(), before.size(), 0) != static_cast<ssize_t>(before.size())) {
      return failure(ErrorCode::system, "cannot write " + path, errno);
    }
  }
  if (::flock(record.get(), LOCK_SH | LOCK_NB) != 0)
    return failure(ErrorCode::system, "cannot lock " + path, errno);
  return record;
}

// Gives one holder's place in the record back; the last one puts the value back.
std::string leave(const std::string& sysfs, const std::string& run_directory, int core, UniqueFd record) {
  // Turning a shared lock into an exclusive one fails while there is another shared one, and gives ours up.
  if (::flock(record.get(), LOCK_EX | LOCK_NB) != 0) return {};
  return restore(sysfs, run_directory, core, record.get());
}

}  // namespace

Result<CoreLatencyHold> CoreLatencyHold::take(const std::string& sysfs, const std::string& run_directory,
                                              int core) {
  const std::string file = latency_file(sysfs, core);
  PLCHOST_TRY_ASSIGN(const auto entered, enter_soon(run_directory));
  PLCHOST_TRY_ASSIGN(const auto before, read_latency(file));
  PLCHOST_TRY_ASSIGN(auto record, make_record(run_directory, core, before));
  auto written = write_latency(file, kNoLatency);
  if (written) {
    const auto now = read_latency(file);
    if (now && *now == kNoLatency) return CoreLatencyHold(sysfs, run_directory, core, std::move(record));
    written = failure(ErrorCode::refused, fmt::format("{} does not keep 'n/a'", file));
  }
  (void)leave(sysfs, run_directory, core, std::move(record));
  return std::unexpected(written.error());
}

CoreLatencyHold::~CoreLatencyHold() {
  if (!record_) return;  // moved from
  const auto entered = enter_soon(run_directory_);
  if (!entered) {
    spdlog::warn("core {}: its wake-up latency stays held: {}", core_, entered.error().describe());
    return;  // the record says so to the next one who looks
  }
  const std::string done = leave(sysfs_, run_directory_, core_, std::move(record_));
  if (!done.empty()) spdlog::info("{}", done);
}

Result<std::vector<std::string>> restore_core_latency(const std::string& sysfs,
                                                      const std::string& run_directory) {
  std::vector<std::string> done;
  std::optional<UniqueFd> entered;
  std::error_code error;
  for (std::filesystem::directory_iterator at(run_directory, error), end; !error && at != end;
       at.increment(error)) {
    const auto core = core_of_record(at->path().filename().string());
    if (!core) continue;
    if (!entered) {
      PLCHOST_TRY_ASSIGN(entered, enter(run_directory));
    }
    const UniqueFd record(::open(at->path().c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
    if (!record || !is_own_or_roots(record.get()) || ::flock(record.get(), LOCK_EX | LOCK_NB) != 0)
      continue;  // somebody holds it
    auto line = restore(sysfs, run_directory, *core, record.get());
    if (!line.empty()) done.push_back(std::move(line));
  }
  return done;
}

}  // namespace plchost
