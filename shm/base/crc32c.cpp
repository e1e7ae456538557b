#include "shm/base/crc32c.hpp"

#include <array>
#include <cstring>

#include "shm/base/crc32c_folding.hpp"

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

// The effect of `length` bytes of zero on the register: a linear map, so a table for each of its bytes will
// do.
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
constexpr std::size_t kCacheLine = 64;
constexpr WordTable kAfterLongLane = after_zeros(kLongLane);
constexpr WordTable kAfterShortLane = after_zeros(kShortLane);

std::uint32_t shifted(const WordTable& table, std::uint32_t state) noexcept {
  return table[0][state & 0xff] ^ table[1][state >> 8 & 0xff] ^ table[2][state >> 16 & 0xff] ^
         table[3][state >> 24];
}

using Copy = ChecksumCopy;

template <Copy How>
__attribute__((always_inline)) inline std::uint64_t take_word(std::byte* to, const std::byte* from) noexcept {
  // Read once: the checksum is that of what was copied, whatever others write there meanwhile.
  std::uint64_t word = 0;
  std::memcpy(&word, from, sizeof word);
  asm volatile("" : "+r"(word));
  if constexpr (How == Copy::plain) std::memcpy(to, &word, sizeof word);
  if constexpr (How == Copy::past_caches) asm volatile("movnti %1, %0" : "=m"(*to) : "r"(word) : "memory");
  return word;
}

/// A stretch of bytes that is gone through: `to` goes with it.
struct Walk {
  std::byte* to;
  std::span<const std::byte> from;

  void advance(std::size_t size) noexcept {
    if (to != nullptr) to += size;
    from = from.subspan(size);
  }
};

template <Copy How, std::size_t Lane>
__attribute__((target("sse4.2"))) std::uint32_t step_lanes(const WordTable& after_lane, std::uint32_t state,
                                                           Walk& walk) noexcept {
  while (walk.from.size() >= kLanes * Lane) {
    std::uint64_t first = state;
    std::uint64_t second = 0;
    std::uint64_t third = 0;
    const std::byte* const from = walk.from.data();
    for (std::size_t i = 0; i < Lane; i += sizeof(std::uint64_t)) {
      // Data from another core's cache take long, and three streams at once are no pattern that the processor
      // would find by itself.
      if (How == Copy::plain && i % kCacheLine == 0) {
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
          __builtin_prefetch(from + i + (lane + kLanes) * Lane);
        }
      }
      std::byte* const to = How == Copy::none ? nullptr : walk.to + i;
      first = __builtin_ia32_crc32di(first, take_word<How>(to, from + i));
      second = __builtin_ia32_crc32di(
          second, take_word<How>(How == Copy::none ? nullptr : to + Lane, from + i + Lane));
      third = __builtin_ia32_crc32di(
          third, take_word<How>(How == Copy::none ? nullptr : to + 2 * Lane, from + i + 2 * Lane));
    }
    state = shifted(after_lane, static_cast<std::uint32_t>(first)) ^ static_cast<std::uint32_t>(second);
    state = shifted(after_lane, state) ^ static_cast<std::uint32_t>(third);
    walk.advance(kLanes * Lane);
  }
  return state;
}

template <Copy How>
__attribute__((target("sse4.2"))) std::uint32_t step_by_instruction(std::uint32_t state, Walk walk) noexcept {
  const bool aligned = reinterpret_cast<std::uintptr_t>(walk.to) % kCacheLine == 0;
  if (walk.from.size() >= kMinFolded && can_fold() && (How != Copy::past_caches || aligned)) {
    walk.advance(fold_crc32c(How, walk.to, walk.from, state));
  }
  state = step_lanes<How, kLongLane>(kAfterLongLane, state, walk);
  state = step_lanes<How, kShortLane>(kAfterShortLane, state, walk);
  std::uint64_t wide = state;
  for (; walk.from.size() >= sizeof(std::uint64_t); walk.advance(sizeof(std::uint64_t))) {
    wide = __builtin_ia32_crc32di(wide, take_word<How>(walk.to, walk.from.data()));
  }
  state = static_cast<std::uint32_t>(wide);
  for (; !walk.from.empty(); walk.advance(1)) {
    const std::byte byte = *static_cast<const volatile std::byte*>(walk.from.data());
    if constexpr (How != Copy::none) *walk.to = byte;
    state = __builtin_ia32_crc32qi(state, static_cast<std::uint8_t>(byte));
  }
  if constexpr (How == Copy::past_caches) __builtin_ia32_sfence();
  return state;
}

bool has_instruction() noexcept {
  static const bool has = __builtin_cpu_supports("sse4.2") != 0;
  return has;
}

#endif

std::uint32_t copy_and_step_by_table(std::byte* to, std::span<const std::byte> from,
                                     std::uint32_t state) noexcept {
  if (!from.empty()) std::memcpy(to, from.data(), from.size());
  return step_by_table(state, {to, from.size()});
}

}  // namespace

std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t so_far) noexcept {
#if defined(__x86_64__)
  if (has_instruction()) return ~step_by_instruction<Copy::none>(~so_far, {nullptr, bytes});
#endif
  return ~step_by_table(~so_far, bytes);
}

std::uint32_t copy_with_crc32c(std::byte* to, std::span<const std::byte> from,
                               std::uint32_t so_far) noexcept {
#if defined(__x86_64__)
  if (has_instruction()) return ~step_by_instruction<Copy::plain>(~so_far, {to, from});
#endif
  return ~copy_and_step_by_table(to, from, ~so_far);
}

std::uint32_t copy_out_with_crc32c(std::byte* to, std::span<const std::byte> from,
                                   std::uint32_t so_far) noexcept {
#if defined(__x86_64__)
  if (has_instruction()) return ~step_by_instruction<Copy::past_caches>(~so_far, {to, from});
#endif
  return ~copy_and_step_by_table(to, from, ~so_far);
}

}  // namespace plchost
