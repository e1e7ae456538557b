#include "instances/io/modbus/images/memory_image.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstring>

#include "instances/io/modbus/config/map_values.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/log/log.hpp"
#include "shm/plc_process_image.h"

namespace plchost::modbus {

namespace {

constexpr std::chrono::milliseconds kSameFor{100};
constexpr std::chrono::seconds kQuietFor{60};

// By words, which no writer is seen in the middle of.
void copy(std::span<const std::byte> from, std::span<std::byte> to) noexcept {
  std::size_t at = 0;
  for (; at + sizeof(std::uint64_t) <= to.size(); at += sizeof(std::uint64_t)) {
    const auto* const word = reinterpret_cast<const std::uint64_t*>(from.data() + at);
    const std::uint64_t value = __atomic_load_n(word, __ATOMIC_RELAXED);
    std::memcpy(to.data() + at, &value, sizeof value);
  }
  for (; at < to.size(); ++at) {
    to[at] = static_cast<std::byte>(
        __atomic_load_n(reinterpret_cast<const std::uint8_t*>(from.data() + at), __ATOMIC_RELAXED));
  }
}

// Of any version and size: others read and write it by its header.
bool begins_as_image(std::span<const std::byte> bytes) noexcept {
  if (bytes.size() < sizeof(plc_image_header)) return false;
  const auto* const word =
      reinterpret_cast<const plc_image_u64*>(bytes.data() + offsetof(plc_image_header, magic));
  return __atomic_load_n(word, __ATOMIC_ACQUIRE) == PLC_IMAGE_MAGIC;
}

template <class Value>
void store(const std::byte* from, std::byte* to) noexcept {
  Value value{};
  std::memcpy(&value, from, sizeof value);
  __atomic_store_n(reinterpret_cast<Value*>(to), value, __ATOMIC_RELAXED);
}

// At most `bytes`, from 2 on, of which no reader sees a half. Their number.
std::size_t store_whole(const std::byte* from, std::byte* to, std::size_t bytes) noexcept {
  const auto at = reinterpret_cast<std::uintptr_t>(to);
  if (bytes >= sizeof(std::uint64_t) && at % sizeof(std::uint64_t) == 0) {
    store<std::uint64_t>(from, to);
    return sizeof(std::uint64_t);
  }
  if (bytes >= sizeof(std::uint32_t) && at % sizeof(std::uint32_t) == 0) {
    store<std::uint32_t>(from, to);
    return sizeof(std::uint32_t);
  }
  if (at % sizeof(std::uint16_t) == 0) {
    store<std::uint16_t>(from, to);
  } else {
    store<std::uint8_t>(from, to);
    store<std::uint8_t>(from + 1, to + 1);
  }
  return sizeof(std::uint16_t);
}

}  // namespace

// Words of a value of 32 bit may lie the other way round, and only one of the two be written.
bool MemoryImage::put_registers(const RegisterMap& map, std::uint32_t first,
                                std::span<const std::uint16_t> registers) {
  const std::lock_guard lock(mutex_);
  if (!refresh()) return false;
  modbus::put_registers(map, first, registers, bytes_);
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < registers.size(); ++i) places.push_back(byte_of(map, first + i));
  std::ranges::sort(places);
  for (std::size_t i = 0; i < places.size();) {
    std::size_t run = 1;
    while (i + run < places.size() && places[i + run] == places[i] + run * sizeof(std::uint16_t)) ++run;
    const std::size_t at = places[i];
    i += store_whole(bytes_.data() + at, memory_->bytes().data() + at, run * sizeof(std::uint16_t)) /
         sizeof(std::uint16_t);
  }
  return !memory_->lost();
}

bool MemoryImage::put_bits(const RegisterMap& map, std::uint32_t first, std::span<const std::uint8_t> bits) {
  const std::lock_guard lock(mutex_);
  if (!refresh()) return false;
  std::uint64_t at = first_bit(map) + first;
  for (const std::uint8_t bit : bits) {
    auto* const byte = reinterpret_cast<std::uint8_t*>(memory_->bytes().data() + at / 8);
    const auto mask = static_cast<std::uint8_t>(1U << (at % 8));
    if (bit != 0) {
      __atomic_fetch_or(byte, mask, __ATOMIC_RELAXED);
    } else {
      __atomic_fetch_and(byte, static_cast<std::uint8_t>(~mask), __ATOMIC_RELAXED);
    }
    ++at;
  }
  return !memory_->lost();
}

bool MemoryImage::refresh() {
  repair();
  if (!memory_) return false;
  copy(memory_->bytes(), bytes_);
  if (memory_->lost()) return false;  // cut short meanwhile: these were zeros
  return !begins_as_image(memory_->bytes());
}

bool MemoryImage::is_process_image(const std::string& pool, const std::string& name) {
  const auto owners = [&pool](uid_t user) { return may_own_memory(pool, user); };
  const auto opened = MemoryFile::open(pool_memory_name(pool, name), sizeof(plc_image_header),
                                       MemoryFile::Access::read_only, owners);
  return opened && opened->guarded() && begins_as_image(opened->bytes());
}

void MemoryImage::repair() {
  const TimePoint now = MonotonicClock::now();
  // A file that others have emptied becomes an image where it lies.
  const bool usable = memory_ && !memory_->lost() && !begins_as_image(memory_->bytes());
  if (usable && now < looked_at_ + kSameFor) return;
  looked_at_ = now;
  const auto owners = [this](uid_t user) { return may_own_memory(pool_, user); };
  auto opened = MemoryFile::open(pool_memory_name(pool_, name_), bytes_.size(), access_, owners);
  const bool is_image = opened && opened->guarded() && begins_as_image(opened->bytes());
  if (opened && opened->guarded() && !is_image) {
    if (!memory_ || memory_->lost() || !memory_->same_file(*opened)) memory_ = std::move(*opened);
    tell_again_ = {};
    return;
  }
  memory_.reset();
  const std::string why = is_image ? "it is a process image; write direction = \"input\" or \"output\""
                          : opened ? "this process has too many memories of others"
                                   : opened.error().describe();
  if (now < tell_again_ && why == told_) return;
  tell_again_ = now + kQuietFor;
  told_ = why;
  spdlog::warn("memory '{}' of pool '{}' is not shown: {}", name_, pool_, why);
}

}  // namespace plchost::modbus
