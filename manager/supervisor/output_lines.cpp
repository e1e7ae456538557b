#include "manager/supervisor/output_lines.hpp"

#include <algorithm>

#include "shm/log/log_line.hpp"

namespace plchost {

namespace {

constexpr std::string_view kRuntime = "plc-instance/";
constexpr std::string_view kOfApplication = "application: ";

// A clock that was set, or a line that only looks like one of the log.
bool is_plausible(std::int64_t time, std::int64_t now) noexcept {
  constexpr std::int64_t kDay = 86'400'000'000'000;
  constexpr std::int64_t kSecond = 1'000'000'000;
  return time <= now + kSecond && time >= now - kDay;
}

// Where a line of the runtime begins that came after a line without an end; the size: nowhere.
std::size_t begin_of_runtime(std::string_view line) {
  constexpr std::size_t kShortest = std::string_view("2026-01-31 12:00:00.000 info ").size();
  constexpr std::size_t kLongest = std::string_view("2026-01-31 12:00:00.000 critical ").size();
  const std::size_t program = line.find(kRuntime);
  if (program == std::string_view::npos) return line.size();
  for (std::size_t length = kShortest; length <= std::min(kLongest, program); ++length) {
    if (parse_log_line(line.substr(program - length))) return program - length;
  }
  return line.size();
}

LogEntry entry_of(std::string_view line, std::int64_t now) {
  LogEntry entry{.time_unix_ns = now, .text = line};
  const auto parsed = parse_log_line(line);
  if (!parsed || !parsed->program.starts_with(kRuntime)) return entry;
  if (is_plausible(parsed->time_unix_ns, now)) entry.time_unix_ns = parsed->time_unix_ns;
  entry.level = parsed->level;
  entry.source = LogSource::runtime;
  entry.text = parsed->text;
  if (entry.text.starts_with(kOfApplication)) {
    entry.source = LogSource::application;
    entry.text.remove_prefix(kOfApplication.size());
  }
  return entry;
}

}  // namespace

void OutputLines::hand_on(std::string_view line, std::int32_t pid, std::int64_t now_unix_ns,
                          const Take& take) {
  if (line.ends_with('\r')) line.remove_suffix(1);
  if (const std::size_t begin = begin_of_runtime(line); begin > 0 && begin < line.size()) {
    hand_on(line.substr(0, begin), pid, now_unix_ns, take);
    line.remove_prefix(begin);
  }
  if (line.empty()) return;
  LogEntry entry = entry_of(line, now_unix_ns);
  entry.pid = pid;
  take(entry);
}

void OutputLines::add(std::string_view bytes, std::int32_t pid, std::int64_t now_unix_ns, const Take& take) {
  while (!bytes.empty()) {
    const std::size_t end = bytes.find('\n');
    const std::string_view part = bytes.substr(0, std::min(end, kMaxLine - begun_.size()));
    begun_ += part;
    bytes.remove_prefix(part.size());
    const bool ended = bytes.starts_with('\n');
    if (ended) bytes.remove_prefix(1);
    if (!ended && begun_.size() < kMaxLine) return;
    hand_on(begun_, pid, now_unix_ns, take);
    begun_.clear();
  }
}

void OutputLines::end(std::int32_t pid, std::int64_t now_unix_ns, const Take& take) {
  hand_on(begun_, pid, now_unix_ns, take);
  begun_.clear();
}

}  // namespace plchost
