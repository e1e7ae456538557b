#include "shm/files/registers.hpp"

#include <cerrno>
#include <cstring>

#include <sys/mman.h>
#include <unistd.h>

namespace plchost {

namespace {

constexpr std::size_t kWord = sizeof(std::uint32_t);

bool is_aligned(const void* address) noexcept {
  return reinterpret_cast<std::uintptr_t>(address) % kWord == 0;
}

// Registers have effects when they are touched: each access is made as it is written here. A fault makes
// outputs safe while a task writes them, so accesses are atomic.
void read_word(std::byte* to, const std::byte* from) noexcept {
  const auto word = __atomic_load_n(reinterpret_cast<const volatile std::uint32_t*>(from), __ATOMIC_RELAXED);
  std::memcpy(to, &word, kWord);
}
void write_word(std::byte* to, const std::byte* from) noexcept {
  std::uint32_t word = 0;
  std::memcpy(&word, from, kWord);
  __atomic_store_n(reinterpret_cast<volatile std::uint32_t*>(to), word, __ATOMIC_RELAXED);
}
void read_byte(std::byte* to, const std::byte* from) noexcept {
  *to = std::byte{__atomic_load_n(reinterpret_cast<const volatile std::uint8_t*>(from), __ATOMIC_RELAXED)};
}
void write_byte(std::byte* to, const std::byte* from) noexcept {
  __atomic_store_n(reinterpret_cast<volatile std::uint8_t*>(to), std::to_integer<std::uint8_t>(*from),
                   __ATOMIC_RELAXED);
}

template <class Word, class Byte>
void copy_aligned(std::byte* to, const std::byte* from, std::size_t bytes, const void* registers,
                  const Word& word, const Byte& byte) noexcept {
  std::size_t at = 0;
  const auto begin = static_cast<const std::byte*>(registers);
  while (at < bytes && !is_aligned(begin + at)) {
    byte(to + at, from + at);
    ++at;
  }
  for (; at + kWord <= bytes; at += kWord) word(to + at, from + at);
  for (; at < bytes; ++at) byte(to + at, from + at);
}

}  // namespace

Result<MappedRegisters> map_registers(int fd, const std::string& device, std::uint64_t address,
                                      std::uint64_t size) {
  // Memory 0 of an uio device is mapped from its beginning, whatever is wanted of it.
  const bool uio = device.starts_with("/dev/uio");
  const auto page = static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  const std::uint64_t begin = uio ? 0 : address / page * page;
  const std::uint64_t length = address + size - begin;
  void* const memory = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, fd,
                              static_cast<off_t>(begin));
  if (memory == MAP_FAILED) return failure(ErrorCode::system, "mmap", errno);
  MappedRegisters mapped;
  mapped.pages = GuardedMapping(std::span(static_cast<std::byte*>(memory), length));
  mapped.bytes = mapped.pages.bytes().subspan(address - begin, size);
  return mapped;
}

void copy_from_registers(std::span<std::byte> to, std::span<const std::byte> registers) noexcept {
  copy_aligned(to.data(), registers.data(), to.size(), registers.data(), read_word, read_byte);
}

void copy_to_registers(std::span<std::byte> registers, std::span<const std::byte> from) noexcept {
  copy_aligned(registers.data(), from.data(), from.size(), registers.data(), write_word, write_byte);
}

}  // namespace plchost
