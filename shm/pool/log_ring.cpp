#include "shm/pool/log_ring.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <new>
#include <utility>

#include <fmt/format.h>

#include "shm/base/time.hpp"
#include "shm/pool/fixed_page.hpp"

namespace plchost {

namespace {

constexpr PageKind kLogRingKind{.what = "log",
                                .magic = 0x676e6972'2d676f6c,  // "log-ring"
                                .version = 1};                 // 1: first
// A ring that has counted so far was written by a stranger.
constexpr std::uint64_t kMaxSequence = std::numeric_limits<std::int64_t>::max();

static_assert(offsetof(LogRingLayout, version) == 8 && sizeof(Seqlock<LogRecord>) == 256);

LogRingLayout& log_ring_of(const MemoryFile& memory) noexcept {
  return *reinterpret_cast<LogRingLayout*>(memory.bytes().data());
}

void describe_log(LogRingLayout& ring, std::int64_t stream) noexcept {
  ring.version = kLogRingKind.version;
  ring.size = sizeof(LogRingLayout);
  ring.stream_unix_ns = stream;
  ring.magic = kLogRingKind.magic;
}

Result<void> fill_log_ring(std::span<std::byte> bytes) {
  describe_log(*new (bytes.data()) LogRingLayout, unix_time_ns());
  return {};
}

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

LogRing::LogRing(std::string name, MemoryFile memory) noexcept
    : name_(std::move(name)), memory_(std::move(memory)) {
  const LogRingLayout& ring = log_ring_of(memory_);
  last_ = ring.last.load(std::memory_order_acquire);
  stream_ = ring.stream_unix_ns;
}

Result<LogRing> LogRing::open(std::string_view pool, std::string_view instance) {
  const std::string name = log_ring_name(pool, instance);
  auto memory = open_fixed_page<LogRingLayout>(name, kLogRingKind, MemoryFile::Access::read_write);
  const bool continues = memory && log_ring_of(*memory).last.load(std::memory_order_relaxed) <= kMaxSequence;
  if (!continues) memory = MemoryFile::replace(name, sizeof(LogRingLayout), fill_log_ring);
  if (!memory) return std::unexpected(std::move(memory).error());
  return LogRing(name, *std::move(memory));
}

void LogRing::remove(std::string_view pool, std::string_view instance) noexcept {
  MemoryFile::remove(log_ring_name(pool, instance));
}

void LogRing::add(const LogEntry& entry) {
  if (memory_.lost()) {
    auto fresh = MemoryFile::replace(name_, sizeof(LogRingLayout), fill_log_ring);
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
  LogRingLayout& ring = log_ring_of(memory_);
  auto& slot = ring.slots[record.sequence % kLogRecordsKept];
  slot.recover();
  slot.write(record);
  last_ = record.sequence;
  describe_log(ring, stream_);  // a stranger may have written over it
  ring.last.store(last_, std::memory_order_release);
}

Result<LogRingReader> LogRingReader::open(std::string_view pool, std::string_view instance) {
  auto memory = open_fixed_page<LogRingLayout>(log_ring_name(pool, instance), kLogRingKind,
                                               MemoryFile::Access::read_only);
  if (!memory) return std::unexpected(std::move(memory).error());
  return LogRingReader(*std::move(memory));
}

LogSlice LogRingReader::read(std::uint64_t after, std::size_t most) const {
  const LogRingLayout& ring = log_ring_of(memory_);
  LogSlice slice{.stream_unix_ns = ring.stream_unix_ns, .last = ring.last.load(std::memory_order_acquire)};
  if (slice.last > kMaxSequence || after >= slice.last) return slice;
  const std::uint64_t oldest = slice.last > kLogRecordsKept ? slice.last - kLogRecordsKept + 1 : 1;
  for (std::uint64_t number = std::max(after + 1, oldest);
       number <= slice.last && slice.records.size() < most; ++number) {
    auto record = ring.slots[number % kLogRecordsKept].read();
    // Overtaken meanwhile, or written by a stranger.
    if (!record || record->sequence != number || !is_known(*record)) continue;
    if (!is_printable_utf8(record->text.view())) {
      record->text.assign(printable(std::string(record->text.view())));
    }
    slice.records.push_back(*record);
  }
  return slice;
}

LogSlice LogRingReader::newest(std::size_t count, std::size_t most) const {
  const std::uint64_t last = log_ring_of(memory_).last.load(std::memory_order_acquire);
  return read(last - std::min<std::uint64_t>(count, last), most);
}

}  // namespace plchost
