#include "shm/pages/flight_page.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <new>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "shm/base/crc32c.hpp"
#include "shm/files/fixed_page.hpp"
#include "shm/pages/instance_page.hpp"

namespace plchost {

namespace {

/// 1: first.
constexpr PageKind kFlightPageKind{.what = "flight recorder",
                                   .magic = 0x7264636572'746c66,  // "fltrecdr"
                                   .version = 1};
constexpr std::size_t kLine = 64;
constexpr std::size_t kEntriesOfAll = std::size_t{1} << 17;
constexpr std::size_t kMostEntries = 4096;
constexpr std::size_t kLeastEntries = 128;

/// A line of its own: the threads that count are on different cores, or the reader is.
struct alignas(kLine) FlightCount {
  FlightRing::Word written{0};
};

static_assert(offsetof(FlightPageLayout, version) == 8 && offsetof(FlightPageLayout, size) == 16);
static_assert(sizeof(FlightTask) == 60 && sizeof(LossRecord) == 192);

constexpr std::size_t in_lines(std::size_t bytes) noexcept {
  return (bytes + kLine - 1) / kLine * kLine;
}
std::size_t rings_of(std::size_t tasks) noexcept {
  return kFirstTaskRing + tasks;
}
std::size_t counts_offset(std::size_t tasks) noexcept {
  return in_lines(sizeof(FlightPageLayout) + tasks * sizeof(FlightTask));
}
std::size_t words_offset(std::size_t tasks) noexcept {
  return counts_offset(tasks) + rings_of(tasks) * sizeof(FlightCount);
}
std::size_t flight_size(std::size_t tasks) noexcept {
  return words_offset(tasks) +
         rings_of(tasks) * flight_capacity(tasks) * FlightRing::kWordsOfEntry * sizeof(FlightRing::Word);
}

FlightPageLayout& flight_layout_of(const MemoryFile& memory) noexcept {
  return *reinterpret_cast<FlightPageLayout*>(memory.bytes().data());
}
FlightTask& flight_task_of(const MemoryFile& memory, std::size_t index) noexcept {
  return reinterpret_cast<FlightTask*>(memory.bytes().data() + sizeof(FlightPageLayout))[index];
}
FlightRing::Word& written_of(const MemoryFile& memory, std::size_t tasks, std::size_t ring) noexcept {
  return reinterpret_cast<FlightCount*>(memory.bytes().data() + counts_offset(tasks))[ring].written;
}
std::span<FlightRing::Word> words_of(const MemoryFile& memory, std::size_t tasks, std::size_t capacity,
                                     std::size_t ring) noexcept {
  const std::size_t words = capacity * FlightRing::kWordsOfEntry;
  auto* const all = reinterpret_cast<FlightRing::Word*>(memory.bytes().data() + words_offset(tasks));
  return {all + ring * words, words};
}

void write_header(FlightPageLayout& page, std::size_t tasks) noexcept {
  page.task_count = static_cast<std::uint32_t>(tasks);
  page.capacity = static_cast<std::uint32_t>(flight_capacity(tasks));
  page.pid = static_cast<std::uint32_t>(::getpid());
  describe_page(page, kFlightPageKind, flight_size(tasks));
}

}  // namespace

std::size_t flight_capacity(std::size_t tasks) noexcept {
  return std::clamp(std::bit_floor(kEntriesOfAll / rings_of(tasks)), kLeastEntries, kMostEntries);
}

std::uint32_t event_mark(std::string_view object) noexcept {
  return crc32c(std::as_bytes(std::span(object))) & kEventMarkMask;
}

std::string flight_page_name(std::string_view pool, std::string_view instance) {
  return fmt::format("{}.recorder.{}", pool, instance);
}

Result<FlightPage> FlightPage::create(std::string_view pool, std::string_view instance,
                                      std::span<const FlightTask> tasks) {
  const auto fill = [&](std::span<std::byte> bytes) -> Result<void> {
    auto* const page = new (bytes.data()) FlightPageLayout;
    auto* place = bytes.data() + sizeof(FlightPageLayout);
    for (const FlightTask& task : tasks) {
      new (place) FlightTask(task);
      place += sizeof(FlightTask);
    }
    write_header(*page, tasks.size());
    return {};
  };
  PLCHOST_TRY_ASSIGN(auto memory,
                     MemoryFile::replace(flight_page_name(pool, instance), flight_size(tasks.size()), fill));
  return FlightPage(std::move(memory), tasks);
}

void FlightPage::remove(std::string_view pool, std::string_view instance) noexcept {
  MemoryFile::remove(flight_page_name(pool, instance));
}

FlightPage::FlightPage(MemoryFile memory, std::span<const FlightTask> tasks)
    : memory_(std::move(memory)),
      tasks_(tasks.begin(), tasks.end()),
      capacity_(flight_capacity(tasks.size())),
      kept_(kLossesKept) {}

FlightRing FlightPage::ring(std::size_t number) noexcept {
  return {written_of(memory_, tasks_.size(), number), words_of(memory_, tasks_.size(), capacity_, number)};
}

FlightRing::Read FlightPage::read(std::size_t number, std::uint64_t from) const {
  return FlightRing::read(written_of(memory_, tasks_.size(), number),
                          words_of(memory_, tasks_.size(), capacity_, number), from);
}

std::uint64_t FlightPage::written(std::size_t number) const noexcept {
  return written_of(memory_, tasks_.size(), number).load(std::memory_order_acquire);
}

void FlightPage::add_loss(std::size_t task, LossRecord record) noexcept {
  const auto of_task =
      std::ranges::count_if(kept_, [&](const Kept& kept) { return kept.number != 0 && kept.task == task; });
  const bool own_place = static_cast<std::size_t>(of_task) >= kLossesOfTask;
  Kept* oldest = nullptr;
  for (Kept& kept : kept_) {
    if (own_place && (kept.number == 0 || kept.task != task)) continue;
    if (oldest == nullptr || kept.number < oldest->number) oldest = &kept;
  }
  *oldest = {.task = task, .number = ++losses_};
  record.number = losses_;
  flight_layout_of(memory_).losses[oldest - kept_.data()].write(record);
}

void FlightPage::keep() noexcept {
  write_header(flight_layout_of(memory_), tasks_.size());
}

Result<FlightPageReader> FlightPageReader::open(std::string_view pool, std::string_view instance) {
  const std::string name = flight_page_name(pool, instance);
  PLCHOST_TRY_ASSIGN(auto memory,
                     open_page<FlightPageLayout>(name, kFlightPageKind, MemoryFile::Access::read_only));
  const FlightPageLayout& page = flight_layout_of(memory);
  // Read once: a stranger may write to the page at any time.
  const std::uint32_t count = page.task_count;
  const std::uint32_t capacity = page.capacity;
  const std::uint64_t size = page.size;
  const auto pid = static_cast<std::int32_t>(page.pid);
  const bool possible = count <= kMaxTasks && capacity == flight_capacity(count) &&
                        size == flight_size(count) && size == memory.bytes().size();
  if (!possible) {
    return failure(ErrorCode::corrupt,
                   fmt::format("flight recorder '{}' says {} tasks with {} entries each; this does not fit "
                               "its size of {} bytes",
                               name, count, capacity, memory.bytes().size()));
  }
  return FlightPageReader(std::move(memory), count, capacity, pid);
}

std::string FlightPageReader::task_name(std::size_t index) const {
  const FixedText<kMaxTaskName> name = flight_task_of(memory_, index).name;
  return printable(std::string(name.view()));
}

std::uint32_t FlightPageReader::event_mark(std::size_t index) const noexcept {
  return flight_task_of(memory_, index).event_mark;
}

std::int32_t FlightPageReader::iec_priority(std::size_t index) const noexcept {
  return flight_task_of(memory_, index).iec_priority;
}

// The newest entries first, so that a reader that comes often does not copy whole rings.
FlightRing::Read FlightPageReader::read_after(std::size_t number, std::int64_t time_ns) const {
  constexpr std::uint64_t kFirstLook = 256;
  constexpr std::uint64_t kMoreEachTime = 4;
  const std::uint64_t end = written_of(memory_, task_count_, number).load(std::memory_order_acquire);
  for (std::uint64_t look = kFirstLook;; look *= kMoreEachTime) {
    const std::uint64_t from = end > look ? end - look : 0;
    FlightRing::Read found = read(number, from);
    std::vector<FlightEntry>& entries = found.entries;
    const auto last = std::find_if(entries.rbegin(), entries.rend(),
                                   [&](const FlightEntry& entry) { return entry.time_ns <= time_ns; });
    if (last == entries.rend() && from > 0 && look < capacity_) continue;
    const auto gone = entries.rend() - last;
    entries.erase(entries.begin(), entries.begin() + gone);
    found.skipped += static_cast<std::uint64_t>(gone);
    return found;
  }
}

FlightRing::Read FlightPageReader::read(std::size_t number, std::uint64_t from) const {
  return FlightRing::read(written_of(memory_, task_count_, number),
                          words_of(memory_, task_count_, capacity_, number), from);
}

std::optional<LossRecord> FlightPageReader::loss(std::size_t place) const noexcept {
  auto record = flight_layout_of(memory_).losses[place].read();
  if (!record || record->number == 0 || record->cause > LossCause::event_variable) return std::nullopt;
  constexpr std::int64_t kMost = INT64_MAX / 8;  // a stranger may have written it: sums of parts have room
  for (const std::int64_t part : {record->own_ns, record->above_ns, record->stall_ns, record->other_ns}) {
    if (part < 0 || part > kMost) return std::nullopt;
  }
  replace_unprintable(record->task);
  replace_unprintable(record->holder);
  return record;
}

std::uint64_t FlightPageReader::loss_sequence(std::size_t place) const noexcept {
  return flight_layout_of(memory_).losses[place].sequence();
}

}  // namespace plchost
