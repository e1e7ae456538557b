#include "shm/pages/exception_history.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "shm/base/plain_json.hpp"
#include "shm/files/read_plain_file.hpp"
#include "shm/files/replace_file.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

using Json = nlohmann::json;

constexpr int kVersion = 1;
constexpr std::size_t kMaxFile = std::size_t{256} << 10;
// More than any instance has in its life; counted on, a greater one would begin at 0 again.
constexpr std::uint64_t kMaxCount = std::uint64_t{1} << 48;
constexpr std::string_view kUntold = "only its process knew it, and could not tell it any more";

Json to_json(const ExceptionEntry& entry) {
  return {{"number", entry.number},
          {"unix_ns", entry.unix_ns},
          {"application", entry.application},
          {"task", entry.task},
          {"kind", entry.kind},
          {"whole_application", entry.whole_application},
          {"signal", entry.signal},
          {"address", entry.address},
          {"symbol", entry.symbol},
          {"memory_address", entry.memory_address},
          {"text", entry.text},
          {"back_trace", entry.back_trace},
          {"back_trace_end", entry.back_trace_end},
          {"activity", entry.activity},
          {"version", entry.circumstances.version},
          {"build", entry.circumstances.build},
          {"scheduler", entry.circumstances.scheduler},
          {"settings", entry.circumstances.settings},
          {"cycles", entry.circumstances.cycles},
          {"uptime_ns", entry.circumstances.uptime_ns}};
}

// value() throws if a key is there with another type; the caller catches.
ExceptionEntry from_json(const Json& json) {
  return {.number = json.value("number", std::uint64_t{0}),
          .unix_ns = json.value("unix_ns", std::int64_t{0}),
          .application = json.value("application", std::string()),
          .task = json.value("task", std::string()),
          .kind = json.value("kind", std::string()),
          .whole_application = json.value("whole_application", true),
          .signal = json.value("signal", std::string()),
          .address = json.value("address", std::uint64_t{0}),
          .symbol = json.value("symbol", std::string()),
          .memory_address = json.value("memory_address", std::uint64_t{0}),
          .text = json.value("text", std::string()),
          .back_trace = json.value("back_trace", std::vector<std::string>()),
          .back_trace_end = json.value("back_trace_end", std::string()),
          .activity = json.value("activity", std::vector<std::string>()),
          .circumstances = {.version = json.value("version", std::string()),
                            .build = json.value("build", std::string()),
                            .scheduler = json.value("scheduler", std::string()),
                            .settings = json.value("settings", std::string()),
                            .cycles = json.value("cycles", std::uint64_t{0}),
                            .uptime_ns = json.value("uptime_ns", std::int64_t{0})}};
}

std::unexpected<Error> corrupt(const std::string& path, std::string_view what) {
  return failure(ErrorCode::corrupt, fmt::format("{}: {}", path, what));
}

// Without a time nothing is known to be the same.
bool same(const ExceptionEntry& one, const ExceptionEntry& other) {
  return one.unix_ns != 0 && one.unix_ns == other.unix_ns && one.task == other.task;
}

bool holds(const ExceptionHistory& history, const ExceptionEntry& entry) {
  return std::ranges::any_of(history.entries, [&](const ExceptionEntry& kept) { return same(kept, entry); });
}

// The manager finds no functions.
bool tells_less(const ExceptionEntry& entry, const ExceptionEntry& known) {
  return entry.back_trace_end == kUntold || (entry.symbol.empty() && !known.symbol.empty()) ||
         (entry.back_trace.empty() && !known.back_trace.empty());
}

// Whether it was there and made room for newer ones. If the oldest one that is kept lies in the future, the
// clock was set back: then times say nothing.
bool was_dropped(const ExceptionHistory& history, const ExceptionEntry& entry) {
  if (history.count <= history.entries.size() || history.entries.empty() || entry.unix_ns == 0) return false;
  const std::int64_t oldest = history.entries.front().unix_ns;
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return entry.unix_ns <= oldest && oldest <= std::chrono::nanoseconds(now).count();
}

std::string to_text(const ExceptionHistory& history) {
  Json entries = Json::array();
  for (const ExceptionEntry& entry : history.entries) entries.push_back(to_json(entry));
  const Json json{{"version", kVersion}, {"count", history.count}, {"exceptions", std::move(entries)}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

// As much of it as a reader takes: the newest exceptions, and of these the newest activities and back-traces.
std::string bounded_text(ExceptionHistory history) {
  std::string text = to_text(history);
  for (ExceptionEntry& entry : history.entries) {
    if (text.size() <= kMaxFile) return text;
    if (!std::exchange(entry.activity, {}).empty()) text = to_text(history);
    if (text.size() <= kMaxFile) return text;
    if (entry.back_trace.empty()) continue;
    entry.back_trace.clear();
    entry.back_trace_end = "it was dropped for those of newer exceptions";
    text = to_text(history);
  }
  while (text.size() > kMaxFile && !history.entries.empty()) {
    history.entries.erase(history.entries.begin());
    text = to_text(history);
  }
  return text;
}

}  // namespace

void ExceptionHistory::add(ExceptionEntry entry) {
  const auto known =
      std::ranges::find_if(entries, [&](const ExceptionEntry& kept) { return same(kept, entry); });
  if (known != entries.end()) {
    if (tells_less(entry, *known)) return;
    entry.number = known->number;
    if (entry.activity.empty()) entry.activity = known->activity;
    // The manager, and an instance of a version before, do not know all of them.
    if (entry.circumstances.version.empty() && !known->circumstances.version.empty()) {
      entry.circumstances = known->circumstances;
    }
    *known = std::move(entry);
    return;
  }
  entry.number = ++count;
  entries.push_back(std::move(entry));
  if (entries.size() > kMaxEntries) entries.erase(entries.begin());
}

// One that was there may take the room of a known one, which would seem new then: so first those that are
// known.
void ExceptionHistory::take(const ExceptionHistory& other) {
  const ExceptionHistory before = *this;
  for (const ExceptionEntry& entry : other.entries) {
    if (holds(before, entry)) add(entry);
  }
  for (const ExceptionEntry& entry : other.entries) {
    if (holds(before, entry) || was_dropped(before, entry)) continue;
    if (entry.number > count) count = entry.number - 1;
    add(entry);
  }
  count = std::max(count, other.count);
}

ExceptionEntry exception_entry(const FaultRecord& record, std::string_view application,
                               std::string_view task) {
  // Other signals give the address of the instruction once more.
  const bool of_memory = record.signal == SIGSEGV || record.signal == SIGBUS;
  // As the process walks the stack: where a signal or a watchdog has stopped the thread.
  const bool stopped = record.kind == FaultKind::signal || record.address != 0;
  return {.unix_ns = record.unix_ns,
          .application = std::string(application),
          .task = std::string(task),
          .kind = std::string(to_string(record.kind)),
          .whole_application = record.whole_application != 0,
          .signal = record.signal != 0 ? signal_name(record.signal) : std::string(),
          .address = record.address,
          .symbol = {},
          .memory_address = of_memory ? record.memory_address : 0,
          .text = describe_fault(record),
          .back_trace = {},
          .back_trace_end = stopped ? std::string(kUntold) : describe_end(BackTrace{})};
}

std::string task_settings(TaskKind kind, Duration interval, int priority, int core) {
  const TaskKindTraits* const traits = find_traits(kind);
  std::string text = fmt::format("{}", traits != nullptr ? traits->name : "of an unknown kind");
  if (interval > Duration::zero()) {
    constexpr double kNsPerMs = 1e6;
    text += fmt::format(", interval {:g} ms", static_cast<double>(interval.count()) / kNsPerMs);
  }
  text += fmt::format(", priority {}", priority);
  return text + (core >= 0 ? fmt::format(", core {}", core) : std::string(", several cores"));
}

std::string exception_path(std::string_view run_directory, std::string_view instance) {
  return fmt::format("{}/{}.exception", run_directory, instance);
}

Result<ExceptionHistory> read_exceptions(const std::string& path) {
  const auto text = read_plain_file(path, kMaxFile);
  if (!text && text.error().code == ErrorCode::not_found) return ExceptionHistory{};
  if (!text && text.error().code == ErrorCode::wrong_type) return corrupt(path, "is no plain file");
  PLCHOST_TRY(text);
  const Json json = plain_json(*text);
  if (!json.is_object()) return corrupt(path, "is not a JSON object");
  try {
    if (json.value("version", 0) != kVersion) return corrupt(path, "is of another version");
    ExceptionHistory history{.count = json.value("count", std::uint64_t{0}), .entries = {}};
    for (const Json& entry : json.value("exceptions", Json::array())) {
      if (history.entries.size() == ExceptionHistory::kMaxEntries) break;
      history.entries.push_back(from_json(entry));
      if (history.entries.back().number > kMaxCount) return corrupt(path, "has a number that is too great");
    }
    if (history.count > kMaxCount) return corrupt(path, "has a count that is too great");
    return history;
  } catch (const Json::exception& error) {
    return corrupt(path, error.what());
  }
}

Result<void> write_exceptions(const std::string& path, const ExceptionHistory& history, mode_t mode) {
  return replace_file(path, bounded_text(history), mode);
}

Result<std::string> keep_exceptions(const std::string& path, std::span<const ExceptionEntry> found) {
  auto history = read_exceptions(path);
  std::string remark;
  if (!history) {
    remark = fmt::format("the exceptions before this one are lost: {}", history.error().describe());
    history = ExceptionHistory{};
  }
  const ExceptionHistory before = *history;
  history->take({.count = 0, .entries = {found.begin(), found.end()}});
  if (*history == before) return remark;
  PLCHOST_TRY(write_exceptions(path, *history));
  return remark;
}

void keep_exceptions_of(std::string_view run_directory, std::string_view instance,
                        std::span<const ExceptionEntry> found) {
  const auto kept = keep_exceptions(exception_path(run_directory, instance), found);
  if (!kept) {
    spdlog::error("instance {}: its exception is not kept: {}", instance, kept.error().describe());
  } else if (!kept->empty()) {
    spdlog::warn("instance {}: {}", instance, *kept);
  }
}

}  // namespace plchost
