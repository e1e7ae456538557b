#include "shm/base/crc32c_folding.hpp"

#if defined(__x86_64__)

#include <array>
#include <bit>

#include <immintrin.h>

namespace plchost {

namespace {

constexpr std::uint64_t kPolynomialForwards = 0x1EDC6F41;  // without its x^32

// x^power modulo the polynomial, as a factor for reflected numbers: bits turned round, one to the left.
constexpr long long factor(unsigned power) {
  std::uint64_t rest = 1;
  for (unsigned i = 0; i < power; ++i) {
    rest <<= 1;
    if ((rest >> 32 & 1) != 0) rest = (rest & 0xffffffff) ^ kPolynomialForwards;
  }
  std::uint64_t turned = 0;
  for (unsigned bit = 0; bit < 32; ++bit) turned |= (rest >> bit & 1) << (31 - bit);
  return std::bit_cast<long long>(turned << 1);
}

/// Carries 128 bits over `bits` bits that follow them: the factor of the lower half, and of the upper.
struct Distance {
  long long lower;
  long long upper;
};
constexpr Distance distance_of(unsigned bits) {
  return {.lower = factor(bits + 32), .upper = factor(bits - 32)};
}

constexpr std::size_t kWide = 64;  // bytes of a register
constexpr std::size_t kStretch = 4 * kWide;
constexpr Distance kOverAll = distance_of(kStretch * 8);
constexpr Distance kOverOne = distance_of(kWide * 8);
constexpr Distance kOverPart = distance_of(128);

#define PLCHOST_FOLDING __attribute__((target("avx512f,vpclmulqdq,pclmul,sse4.2"), always_inline))

PLCHOST_FOLDING inline __m512i wide(const Distance& distance) noexcept {
  return _mm512_set_epi64(distance.upper, distance.lower, distance.upper, distance.lower, distance.upper,
                          distance.lower, distance.upper, distance.lower);
}

PLCHOST_FOLDING inline __m512i folded(__m512i sum, __m512i distance, __m512i next) noexcept {
  const __m512i lower = _mm512_clmulepi64_epi128(sum, distance, 0x00);
  const __m512i upper = _mm512_clmulepi64_epi128(sum, distance, 0x11);
  return _mm512_xor_si512(_mm512_xor_si512(lower, upper), next);
}

PLCHOST_FOLDING inline __m128i folded(__m128i sum, __m128i distance, __m128i next) noexcept {
  const __m128i lower = _mm_clmulepi64_si128(sum, distance, 0x00);
  const __m128i upper = _mm_clmulepi64_si128(sum, distance, 0x11);
  return _mm_xor_si128(_mm_xor_si128(lower, upper), next);
}

template <ChecksumCopy How>
PLCHOST_FOLDING inline __m512i take(std::byte* to, const std::byte* from) noexcept {
  __m512i word = _mm512_loadu_si512(from);  // NOLINT(misc-const-correctness): the next line may change it
  // Read once: the checksum is that of what was copied, whatever others write there meanwhile.
  asm volatile("" : "+v"(word));
  if constexpr (How == ChecksumCopy::plain) _mm512_storeu_si512(to, word);
  if constexpr (How == ChecksumCopy::past_caches) _mm512_stream_si512(reinterpret_cast<__m512i*>(to), word);
  return word;
}

/// A stretch of bytes. The folded value has the same checksum as all that has gone in.
struct Stretch {
  __m512i first;
  __m512i second;
  __m512i third;
  __m512i fourth;
};

template <ChecksumCopy How>
PLCHOST_FOLDING inline Stretch take_stretch(std::byte* to, const std::byte* from) noexcept {
  if constexpr (How == ChecksumCopy::none) {
    return {.first = take<How>(nullptr, from),
            .second = take<How>(nullptr, from + kWide),
            .third = take<How>(nullptr, from + 2 * kWide),
            .fourth = take<How>(nullptr, from + 3 * kWide)};
  } else {
    return {.first = take<How>(to, from),
            .second = take<How>(to + kWide, from + kWide),
            .third = take<How>(to + 2 * kWide, from + 2 * kWide),
            .fourth = take<How>(to + 3 * kWide, from + 3 * kWide)};
  }
}

PLCHOST_FOLDING inline std::uint32_t checksum_of(const Stretch& sums) noexcept {
  const __m512i over_one = wide(kOverOne);
  __m512i sum = folded(sums.first, over_one, sums.second);
  sum = folded(sum, over_one, sums.third);
  sum = folded(sum, over_one, sums.fourth);
  const __m128i over_part = _mm_set_epi64x(kOverPart.upper, kOverPart.lower);
  alignas(kWide) std::array<std::uint64_t, kWide / sizeof(std::uint64_t)> parts{};
  _mm512_store_si512(parts.data(), sum);
  __m128i rest = _mm_load_si128(reinterpret_cast<const __m128i*>(parts.data()));
  for (std::size_t part = 2; part < parts.size(); part += 2) {
    rest = folded(rest, over_part, _mm_load_si128(reinterpret_cast<const __m128i*>(&parts[part])));
  }
  const auto lower = static_cast<std::uint64_t>(_mm_cvtsi128_si64(rest));
  const auto upper = static_cast<std::uint64_t>(_mm_extract_epi64(rest, 1));
  return static_cast<std::uint32_t>(__builtin_ia32_crc32di(__builtin_ia32_crc32di(0, lower), upper));
}

template <ChecksumCopy How>
PLCHOST_FOLDING inline std::uint32_t fold(std::byte* to, std::span<const std::byte> from,
                                          std::uint32_t state) noexcept {
  const __m512i distance = wide(kOverAll);
  Stretch sums = take_stretch<How>(to, from.data());
  const __m128i before = _mm_cvtsi32_si128(static_cast<int>(state));
  sums.first = _mm512_xor_si512(sums.first, _mm512_zextsi128_si512(before));
  for (std::size_t at = kStretch; at < from.size(); at += kStretch) {
    std::byte* const here = How == ChecksumCopy::none ? nullptr : to + at;
    const Stretch next = take_stretch<How>(here, from.data() + at);
    sums = {.first = folded(sums.first, distance, next.first),
            .second = folded(sums.second, distance, next.second),
            .third = folded(sums.third, distance, next.third),
            .fourth = folded(sums.fourth, distance, next.fourth)};
  }
  if constexpr (How == ChecksumCopy::past_caches) _mm_sfence();
  return checksum_of(sums);
}

}  // namespace

bool can_fold() noexcept {
  static const bool can = __builtin_cpu_supports("avx512f") != 0 &&
                          __builtin_cpu_supports("vpclmulqdq") != 0 &&
                          __builtin_cpu_supports("pclmul") != 0 && __builtin_cpu_supports("sse4.2") != 0;
  return can;
}

__attribute__((target("avx512f,vpclmulqdq,pclmul,sse4.2"))) std::size_t fold_crc32c(
    ChecksumCopy how, std::byte* to, std::span<const std::byte> from, std::uint32_t& state) noexcept {
  const auto stretches = from.first(from.size() / kStretch * kStretch);
  switch (how) {
    case ChecksumCopy::none:
      state = fold<ChecksumCopy::none>(to, stretches, state);
      break;
    case ChecksumCopy::plain:
      state = fold<ChecksumCopy::plain>(to, stretches, state);
      break;
    case ChecksumCopy::past_caches:
      state = fold<ChecksumCopy::past_caches>(to, stretches, state);
      break;
  }
  return stretches.size();
}

}  // namespace plchost

#endif
