#include "instances/runtime/memory/retain_memory.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "instances/runtime/memory/area_record.hpp"
#include "shm/base/names.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/pool_files.hpp"

namespace plchost {

namespace {

// "plckept2", as bytes in memory. The version is its last letter, not a field as fixed_page.hpp has it:
// another header would cost the values that a host keeps when it is updated.
constexpr std::uint64_t kRetainMagic = 0x327470656b636c70;
// The last bytes of the memory. A file that was cut anywhere has lost them, also if it was made longer again.
constexpr std::uint64_t kRetainEnd = ~kRetainMagic;

// Read after what was copied before.
bool has_its_end(std::span<const std::byte> memory) noexcept {
  std::atomic_thread_fence(std::memory_order_acquire);
  return *reinterpret_cast<const volatile std::uint64_t*>(memory.last(sizeof(kRetainEnd)).data()) ==
         kRetainEnd;
}

}  // namespace

struct RetainMemory::Header {
  std::uint64_t magic;
  std::atomic<std::uint64_t> generation;  // written by the soft thread
  std::uint64_t areas;
  std::uint64_t bytes;
  FixedText<kMaxTaskName> application;
  std::array<char, 13> zero;
  std::array<AreaRecord, kMaxRetainAreas> entries;
  std::array<CycleCounter, PLC_MAX_TASKS> counters;  // each written by its task
};

std::size_t RetainMemory::bytes_for(std::uint64_t data) noexcept {
  static_assert(sizeof(Header) == 96 + std::size_t{80} * kMaxRetainAreas + std::size_t{8} * PLC_MAX_TASKS &&
                sizeof(Header) % kRetainAlignment == 0);
  return sizeof(Header) + (data + kRetainAlignment - 1) / kRetainAlignment * kRetainAlignment +
         sizeof(kRetainEnd);
}

RetainMemory::Header& RetainMemory::header() const noexcept {
  return *reinterpret_cast<Header*>(bytes_.data());
}

Result<RetainMemory::Left> RetainMemory::left_behind(const std::string& pool, const std::string& name) {
  const auto damaged = [&](std::string_view what) {
    return failure(ErrorCode::corrupt, fmt::format("memory '{}': {}", name, what));
  };
  PLCHOST_TRY_ASSIGN(const auto file, MemoryFile::open(pool_memory_name(pool, name), sizeof(Header),
                                                       MemoryFile::Access::read_only));
  const Header& header = *reinterpret_cast<const Header*>(file.bytes().data());
  Left left;
  RetainLayout& layout = left.image.layout;
  layout.bytes = header.bytes;
  const std::uint64_t areas = header.areas;
  if (header.magic != kRetainMagic || areas > kMaxRetainAreas || layout.bytes > kMaxRetainBytes ||
      file.bytes().size() != bytes_for(layout.bytes)) {
    return damaged("its header is overwritten, or of another version");
  }
  layout.application = header.application.view();
  for (std::uint64_t i = 0; i < areas; ++i) {
    auto area = area_of(AreaRecord(header.entries[i]));  // a copy: a stranger may write it meanwhile
    if (!area) return damaged("the name of an area has no end");
    layout.areas.push_back(*std::move(area));
  }
  if (auto valid = check_layout(layout); !valid) return damaged(valid.error().message);
  left.image.generation = header.generation.load(std::memory_order_relaxed);
  const auto data = file.bytes().subspan(sizeof(Header), layout.bytes);
  left.image.data.assign(data.begin(), data.end());
  left.in_cycle =
      static_cast<std::size_t>(std::ranges::count_if(header.counters, [](const CycleCounter& counter) {
        return counter.load(std::memory_order_relaxed) % 2 != 0;
      }));
  if (!has_its_end(file.bytes()) || file.lost()) return damaged("it was cut short");
  return left;
}

namespace {

std::unexpected<Error> not_guarded() {
  return failure(ErrorCode::full,
                 fmt::format("retain variables: more than {} memories of others", MemoryGuard::kMost));
}

}  // namespace

Result<RetainMemory> RetainMemory::take_over(ObjectPool& pool, const std::string& name,
                                             const RetainLayout& layout) {
  PLCHOST_TRY_ASSIGN(auto opened, in_step("retain variables", pool.open_memory(name)));
  const std::size_t bytes = bytes_for(layout.bytes);
  if (opened.bytes().size() != bytes) {
    return failure(ErrorCode::wrong_size,
                   fmt::format("retain variables: their memory has {} bytes, {} are needed",
                               opened.bytes().size(), bytes));
  }
  if (!opened.guarded()) return not_guarded();
  RetainMemory kept(std::move(opened));
  for (CycleCounter& counter : kept.header().counters) counter.store(0, std::memory_order_relaxed);
  return kept;
}

Result<RetainMemory> RetainMemory::prepare(ObjectPool& pool, const std::string& name,
                                           const RetainImage& image) {
  if (const auto known = pool.look_at(name); known && known->type != ObjectType::memory) {
    return failure(ErrorCode::wrong_type, fmt::format("retain variables: '{}' is no shared memory but a {}",
                                                      name, to_string(known->type)));
  }
  PLCHOST_TRY_ASSIGN(auto prepared,
                     in_step("retain variables", pool.prepare_memory(name, bytes_for(image.layout.bytes))));
  if (!prepared.guarded()) return not_guarded();
  const std::span bytes = prepared.bytes();
  auto& header = *reinterpret_cast<Header*>(bytes.data());
  header.magic = kRetainMagic;
  header.generation.store(image.generation, std::memory_order_relaxed);
  header.areas = image.layout.areas.size();
  header.bytes = image.layout.bytes;
  header.application.assign(image.layout.application);
  for (std::size_t i = 0; i < image.layout.areas.size(); ++i) {
    header.entries[i] = record_of(image.layout.areas[i]);
  }
  std::ranges::copy(image.data, bytes.begin() + sizeof(Header));
  std::memcpy(bytes.last(sizeof(kRetainEnd)).data(), &kRetainEnd, sizeof(kRetainEnd));
  return RetainMemory(std::move(prepared));
}

Result<void> RetainMemory::publish(ObjectPool& pool, const std::string& name) {
  if (!prepared_) return {};
  PLCHOST_TRY_ASSIGN(memory_, in_step("retain variables", pool.replace_memory(name, *prepared_)));
  prepared_.reset();
  return {};
}

std::span<std::byte> RetainMemory::data() const noexcept {
  return bytes_.subspan(sizeof(Header), bytes_.size() - bytes_for(0));
}

CycleCounter& RetainMemory::counter(std::size_t task) const noexcept {
  return header().counters.at(task);
}

void RetainMemory::set_generation(std::uint64_t generation) const noexcept {
  header().generation.store(generation, std::memory_order_relaxed);
}

void RetainMemory::live_elsewhere(std::size_t offset, std::span<std::byte> live) {
  std::ranges::copy(data().subspan(offset, live.size()), live.begin());
  elsewhere_.push_back({.offset = offset, .live = live});
}

void RetainMemory::add_group(const std::vector<std::size_t>& tasks,
                             const std::vector<std::pair<std::size_t, std::size_t>>& stretches) {
  std::vector<const CycleCounter*> counters;
  for (const std::size_t task : tasks) counters.push_back(&counter(task));
  std::vector<RetainGroup::Part> parts;
  for (const auto& [offset, bytes] : stretches) {
    const auto other = std::ranges::find(elsewhere_, offset, &Elsewhere::offset);
    parts.push_back(
        {.offset = offset, .live = other != elsewhere_.end() ? other->live : data().subspan(offset, bytes)});
  }
  groups_.emplace_back(std::move(counters), std::move(parts));
}

// A cut that has taken any data has taken the end, too.
bool RetainMemory::is_whole() const noexcept {
  const bool has_end = has_its_end(bytes_);
  const Header& kept = header();
  const bool described = kept.magic == kRetainMagic && bytes_for(kept.bytes) == bytes_.size();
  const bool elsewhere = std::ranges::none_of(
      elsewhere_, [](const Elsewhere& part) { return MemoryGuard::is_lost(part.live.data()); });
  return has_end && described && elsewhere && !memory_.lost();
}

void RetainMemory::copy_elsewhere(std::span<const std::byte> taken) const noexcept {
  for (const auto& [offset, live] : elsewhere_) {
    std::ranges::copy(taken.subspan(offset, live.size()),
                      data().begin() + static_cast<std::ptrdiff_t>(offset));
  }
}

bool RetainMemory::snapshot(std::span<std::byte> copy) const noexcept {
  std::array<std::uint64_t, PLC_MAX_TASKS> before{};
  const auto& counters = header().counters;
  for (std::size_t i = 0; i < before.size(); ++i) {
    before[i] = counters[i].load(std::memory_order_acquire);  // pairs with the end of a cycle
    if (before[i] % 2 != 0) return false;
  }
  // Nobody else writes into that part of the data: it is a copy for the next process.
  for (const auto& [offset, live] : elsewhere_) copy_moving(data().data() + offset, live.data(), live.size());
  copy_moving(copy.data(), data().data(), copy.size());
  // Pairs with the release fence at the start of a cycle: its writes are seen after its odd count.
  std::atomic_thread_fence(std::memory_order_acquire);
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (counters[i].load(std::memory_order_relaxed) != before[i]) return false;
  }
  return true;
}

}  // namespace plchost
