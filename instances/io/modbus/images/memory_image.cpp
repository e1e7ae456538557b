#include "instances/io/modbus/images/memory_image.hpp"

#include <chrono>
#include <cstring>

#include "shm/files/pool_files.hpp"
#include "shm/log/log.hpp"

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

}  // namespace

bool MemoryImage::refresh() {
  repair();
  if (!memory_) return false;
  copy(memory_->bytes(), bytes_);
  return !memory_->lost();  // cut short meanwhile: these were zeros
}

void MemoryImage::repair() {
  const TimePoint now = MonotonicClock::now();
  if (memory_ && !memory_->lost() && now < looked_at_ + kSameFor) return;
  looked_at_ = now;
  const auto owners = [this](uid_t user) { return may_own_memory(pool_, user); };
  auto opened =
      MemoryFile::open(pool_memory_name(pool_, name_), bytes_.size(), MemoryFile::Access::read_only, owners);
  if (opened && opened->guarded()) {
    if (!memory_ || memory_->lost() || !memory_->same_file(*opened)) memory_ = std::move(*opened);
    tell_again_ = {};
    return;
  }
  memory_.reset();
  if (now < tell_again_) return;
  tell_again_ = now + kQuietFor;
  spdlog::warn("memory '{}' of pool '{}' is not shown: {}", name_, pool_,
               opened ? "this process has too many memories of others" : opened.error().describe());
}

}  // namespace plchost::modbus
