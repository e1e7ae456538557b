#include "shm/base/crc32c.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace plchost {

namespace {

constexpr std::uint32_t kPolynomial = 0x82F63B78;  // reflected

using ByteTable = std::array<std::uint32_t, 256>;
using WordTable = std::array<ByteTable, 4>;

/// The checksum register after one byte, for each value of the byte.
constexpr ByteTable kAfterByte = [] {
  ByteTable table{};
  for (std::uint32_t byte = 0; byte < table.size(); ++byte) {
    std::uint32_t value = byte;
    for (int bit = 0; bit < 8; ++bit) value = (value >> 1) ^ ((value & 1) != 0 ? kPolynomial : 0);
    table[byte] = value;
  }
  return table;
}();

// What `length` bytes of zero make of the register: a linear map, so a table for each of its bytes will do.
constexpr WordTable after_zeros(std::size_t length) {
  std::array<std::uint32_t, 32> images{};  // of each bit
  for (std::size_t bit = 0; bit < images.size(); ++bit) {
    std::uint32_t value = std::uint32_t{1} << bit;
    for (std::size_t i = 0; i < length; ++i) value = (value >> 8) ^ kAfterByte[value & 0xff];
    images[bit] = value;
  }
  WordTable table{};
  for (std::size_t part = 0; part < table.size(); ++part) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      for (std::size_t bit = 0; bit < 8; ++bit) {
        if ((byte >> bit & 1) != 0) table[part][byte] ^= images[part * 8 + bit];
      }
    }
  }
  return table;
}

std::uint32_t step_by_table(std::uint32_t state, std::span<const std::byte> bytes) noexcept {
  for (const std::byte byte : bytes) {
    state = (state >> 8) ^ kAfterByte[(state ^ static_cast<std::uint32_t>(byte)) & 0xff];
  }
  return state;
}

#if defined(__x86_64__)

// The instruction takes three cycles and one can begin in each: so three stretches go side by side.
constexpr std::size_t kLongLane = 1024;
constexpr std::size_t kShortLane = 128;
constexpr std::size_t kLanes = 3;
constexpr WordTable kAfterLongLane = after_zeros(kLongLane);
constexpr WordTable kAfterShortLane = after_zeros(kShortLane);

std::uint32_t shifted(const WordTable& table, std::uint32_t state) noexcept {
  return table[0][state & 0xff] ^ table[1][state >> 8 & 0xff] ^ table[2][state >> 16 & 0xff] ^
         table[3][state >> 24];
}

std::uint64_t word_at(const std::byte* from) noexcept {
  std::uint64_t word = 0;
  std::memcpy(&word, from, sizeof word);
  return word;
}

template <std::size_t Lane>
__attribute__((target("sse4.2"))) std::uint32_t step_lanes(const WordTable& after_lane, std::uint32_t state,
                                                           std::span<const std::byte>& bytes) noexcept {
  while (bytes.size() >= kLanes * Lane) {
    std::uint64_t first = state;
    std::uint64_t second = 0;
    std::uint64_t third = 0;
    for (std::size_t i = 0; i < Lane; i += sizeof(std::uint64_t)) {
      first = __builtin_ia32_crc32di(first, word_at(bytes.data() + i));
      second = __builtin_ia32_crc32di(second, word_at(bytes.data() + Lane + i));
      third = __builtin_ia32_crc32di(third, word_at(bytes.data() + 2 * Lane + i));
    }
    state = shifted(after_lane, static_cast<std::uint32_t>(first)) ^ static_cast<std::uint32_t>(second);
    state = shifted(after_lane, state) ^ static_cast<std::uint32_t>(third);
    bytes = bytes.subspan(kLanes * Lane);
  }
  return state;
}

__attribute__((target("sse4.2"))) std::uint32_t step_by_instruction(
    std::uint32_t state, std::span<const std::byte> bytes) noexcept {
  state = step_lanes<kLongLane>(kAfterLongLane, state, bytes);
  state = step_lanes<kShortLane>(kAfterShortLane, state, bytes);
  std::uint64_t wide = state;
  for (; bytes.size() >= sizeof(std::uint64_t); bytes = bytes.subspan(sizeof(std::uint64_t))) {
    wide = __builtin_ia32_crc32di(wide, word_at(bytes.data()));
  }
  state = static_cast<std::uint32_t>(wide);
  for (const std::byte byte : bytes) state = __builtin_ia32_crc32qi(state, static_cast<std::uint8_t>(byte));
  return state;
}

std::uint32_t step(std::uint32_t state, std::span<const std::byte> bytes) noexcept {
  static const bool has_instruction = __builtin_cpu_supports("sse4.2") != 0;
  return has_instruction ? step_by_instruction(state, bytes) : step_by_table(state, bytes);
}

#else

std::uint32_t step(std::uint32_t state, std::span<const std::byte> bytes) noexcept {
  return step_by_table(state, bytes);
}

#endif

}  // namespace

std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t so_far) noexcept {
  return ~step(~so_far, bytes);
}

std::uint32_t copy_with_crc32c(std::byte* to, std::span<const std::byte> from,
                               std::uint32_t so_far) noexcept {
  // In pieces, so that what was copied is still in the nearest cache when it is read.
  constexpr std::size_t kPiece = 6144;
  std::uint32_t state = ~so_far;
  while (!from.empty()) {
    const std::size_t size = std::min(from.size(), kPiece);
    std::memcpy(to, from.data(), size);
    state = step(state, {to, size});
    to += size;
    from = from.subspan(size);
  }
  return ~state;
}

}  // namespace plchost
