#include "instances/runtime/retain/kept_memory.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "instances/runtime/retain/area_record.hpp"
#include "shm/base/names.hpp"
#include "shm/pool/memory_file.hpp"

namespace plchost {

namespace {

// "plckept1", as bytes in memory.
constexpr std::uint64_t kKeptMagic = 0x317470656b636c70;

// Tasks write what is read here: a copy that they were in the way of is thrown away.
__attribute__((no_sanitize("thread"))) void copy_moving(std::byte* to, const std::byte* from,
                                                        std::size_t bytes) noexcept {
  std::size_t at = 0;
  for (; at + sizeof(std::uint64_t) <= bytes; at += sizeof(std::uint64_t)) {
    const std::uint64_t word = *reinterpret_cast<const volatile std::uint64_t*>(from + at);
    *reinterpret_cast<std::uint64_t*>(to + at) = word;
  }
  for (; at < bytes; ++at) to[at] = *const_cast<const volatile std::byte*>(from + at);
}

}  // namespace

struct KeptMemory::Header {
  std::uint64_t magic;
  std::atomic<std::uint64_t> generation;  // written by the soft thread
  std::uint64_t areas;
  std::uint64_t bytes;
  FixedText<kMaxTaskName> application;
  std::array<char, 13> zero;
  std::array<AreaRecord, kMaxRetainAreas> entries;
  std::array<CycleCounter, PLC_MAX_TASKS> counters;  // each written by its task
};

std::string KeptMemory::name_for(const std::string& instance) {
  return instance + ".retain";
}

std::size_t KeptMemory::bytes_for(std::uint64_t data) noexcept {
  static_assert(sizeof(Header) == 96 + std::size_t{80} * kMaxRetainAreas + std::size_t{8} * PLC_MAX_TASKS &&
                sizeof(Header) % kRetainAlignment == 0);
  return sizeof(Header) + data;
}

KeptMemory::Header& KeptMemory::header() const noexcept {
  return *reinterpret_cast<Header*>(memory_.bytes().data());
}

std::optional<KeptMemory::Left> KeptMemory::left_behind(const std::string& pool, const std::string& name) {
  const auto file =
      MemoryFile::open(pool_memory_name(pool, name), sizeof(Header), MemoryFile::Access::read_only);
  if (!file) return std::nullopt;
  const MemoryGuard guard(file->bytes());  // it may be cut short now
  const Header& header = *reinterpret_cast<const Header*>(file->bytes().data());
  Left left;
  RetainLayout& layout = left.image.layout;
  layout.bytes = header.bytes;
  const std::uint64_t areas = header.areas;
  if (header.magic != kKeptMagic || areas > kMaxRetainAreas || layout.bytes > kMaxRetainBytes ||
      file->bytes().size() != bytes_for(layout.bytes)) {
    return std::nullopt;
  }
  layout.application = header.application.view();
  for (std::uint64_t i = 0; i < areas; ++i) {
    auto area = area_of(AreaRecord(header.entries[i]));  // a copy: a stranger may write it meanwhile
    if (!area) return std::nullopt;
    layout.areas.push_back(*std::move(area));
  }
  if (!check_layout(layout)) return std::nullopt;
  left.image.generation = header.generation.load(std::memory_order_relaxed);
  const auto data = file->bytes().subspan(sizeof(Header));
  left.image.data.assign(data.begin(), data.end());
  left.in_cycle =
      static_cast<std::size_t>(std::ranges::count_if(header.counters, [](const CycleCounter& counter) {
        return counter.load(std::memory_order_relaxed) % 2 != 0;
      }));
  return guard.lost() ? std::nullopt : std::optional(std::move(left));
}

Result<KeptMemory> KeptMemory::take_over(const std::string& pool, const std::string& name,
                                         const RetainLayout& layout) {
  auto memory = AreaMemory::of_file(pool_memory_name(pool, name), bytes_for(layout.bytes));
  if (!memory) return std::unexpected(std::move(memory).error());
  KeptMemory kept(*std::move(memory));
  for (CycleCounter& counter : kept.header().counters) counter.store(0, std::memory_order_relaxed);
  return kept;
}

Result<KeptMemory> KeptMemory::make(const std::string& pool, const std::string& name,
                                    const RetainImage& image) {
  const auto fill = [&](std::span<std::byte> bytes) -> Result<void> {
    auto& header = *reinterpret_cast<Header*>(bytes.data());
    header.magic = kKeptMagic;
    header.generation.store(image.generation, std::memory_order_relaxed);
    header.areas = image.layout.areas.size();
    header.bytes = image.layout.bytes;
    header.application.assign(image.layout.application);
    for (std::size_t i = 0; i < image.layout.areas.size(); ++i) {
      header.entries[i] = record_of(image.layout.areas[i]);
    }
    std::ranges::copy(image.data, bytes.begin() + sizeof(Header));
    return {};
  };
  auto memory = AreaMemory::new_file(pool_memory_name(pool, name), bytes_for(image.layout.bytes), fill);
  if (!memory) return std::unexpected(std::move(memory).error());
  return KeptMemory(*std::move(memory));
}

std::span<std::byte> KeptMemory::data() const noexcept {
  return memory_.bytes().subspan(sizeof(Header));
}

CycleCounter& KeptMemory::counter(std::size_t task) const noexcept {
  return header().counters.at(task);
}

void KeptMemory::set_generation(std::uint64_t generation) const noexcept {
  header().generation.store(generation, std::memory_order_relaxed);
}

void KeptMemory::live_elsewhere(std::size_t offset, std::span<std::byte> live) {
  std::ranges::copy(data().subspan(offset, live.size()), live.begin());
  elsewhere_.push_back({.offset = offset, .live = live});
}

bool KeptMemory::snapshot(std::span<std::byte> copy) const noexcept {
  std::array<std::uint64_t, PLC_MAX_TASKS> before{};
  const auto& counters = header().counters;
  for (std::size_t i = 0; i < before.size(); ++i) {
    before[i] = counters[i].load(std::memory_order_acquire);  // pairs with the end of a cycle
    if (before[i] % 2 != 0) return false;
  }
  // Nobody else writes into that part of the data: it is a copy for the next process.
  for (const auto& [offset, live] : elsewhere_) copy_moving(data().data() + offset, live.data(), live.size());
  copy_moving(copy.data(), data().data(), copy.size());
  // Pairs with the release fence at the start of a cycle: what it writes is seen after its odd count.
  std::atomic_thread_fence(std::memory_order_acquire);
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (counters[i].load(std::memory_order_relaxed) != before[i]) return false;
  }
  return true;
}

}  // namespace plchost
