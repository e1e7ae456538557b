#include "shm/pages/log_ring.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

namespace plchost {

namespace {

static_assert(offsetof(LogRingLayout, version) == 8 && sizeof(Seqlock<LogRecord>) == 256);

// A tabulator is no attack.
std::string line_of(std::string_view text) {
  std::string line(text);
  std::ranges::replace(line, '\t', ' ');
  return printable(std::move(line));
}

bool is_known(const LogRecord& record) noexcept {
  return std::to_underlying(record.level) <= std::to_underlying(LogLevel::error) &&
         std::to_underlying(record.source) <= std::to_underlying(LogSource::manager);
}

}  // namespace

std::string log_ring_name(std::string_view pool, std::string_view instance) {
  return fmt::format("{}.log.{}", pool, instance);
}

LogRing::LogRing(std::string name, LogRingPage page) noexcept
    : name_(std::move(name)),
      page_(std::move(page)),
      last_(page_.last()),
      stream_(page_.layout().stream_unix_ns) {}

Result<LogRing> LogRing::open(std::string_view pool, std::string_view instance) {
  const std::string name = log_ring_name(pool, instance);
  PLCHOST_TRY_ASSIGN(auto page, LogRingPage::open(name, managers_page()));
  return LogRing(name, std::move(page));
}

void LogRing::remove(std::string_view pool, std::string_view instance) noexcept {
  MemoryFile::remove(log_ring_name(pool, instance));
}

void LogRing::add(const LogEntry& entry) {
  if (page_.lost()) {
    auto fresh = LogRingPage::renew(name_, managers_page());
    if (!fresh) return;
    *this = LogRing(name_, *std::move(fresh));
  }
  const std::string line = line_of(entry.text);
  std::string_view rest = line;
  do {
    const std::string_view part = cut(rest, kMaxLogText);
    rest.remove_prefix(part.size());
    add_record({.sequence = last_ + 1,
                .time_unix_ns = entry.time_unix_ns,
                .pid = entry.pid,
                .level = entry.level,
                .source = entry.source,
                .goes_on = rest.empty() ? 0U : 1U,
                .text = FixedText<kMaxLogText>(part)});
  } while (!rest.empty());
}

// The record before its number: a manager that is killed in between writes the same slot again.
void LogRing::add_record(const LogRecord& record) noexcept {
  page_.put(record);
  last_ = record.sequence;
  LogRingLayout& ring = page_.layout();
  ring.stream_unix_ns = stream_;  // a stranger may have written over it
  describe_page(ring, kLogRingKind);
  ring.last.store(last_, std::memory_order_release);
}

Result<LogRingReader> LogRingReader::open(std::string_view pool, std::string_view instance) {
  PLCHOST_TRY_ASSIGN(auto page, LogRingPage::open_to_read(log_ring_name(pool, instance)));
  return LogRingReader(std::move(page));
}

LogSlice LogRingReader::read(std::uint64_t after, std::size_t most) const {
  LogSlice slice{.stream_unix_ns = page_.layout().stream_unix_ns, .last = page_.last()};
  if (slice.last > LogRingPage::kMaxSequence || after >= slice.last) return slice;
  for (std::uint64_t number = std::max(after + 1, LogRingPage::oldest(slice.last));
       number <= slice.last && slice.records.size() < most; ++number) {
    auto record = page_.get(number);
    // Overtaken meanwhile, or written by a stranger.
    if (!record || !is_known(*record)) continue;
    replace_unprintable(record->text);
    slice.records.push_back(*record);
  }
  return slice;
}

LogSlice LogRingReader::newest(std::size_t count, std::size_t most) const {
  const std::uint64_t last = page_.last();
  return read(last - std::min<std::uint64_t>(count, last), most);
}

}  // namespace plchost
