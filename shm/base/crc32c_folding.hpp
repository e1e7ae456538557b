#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace plchost {

/// The copying of bytes beside their checksum. `past_caches`: written without reading their lines.
enum class ChecksumCopy : std::uint8_t { none, plain, past_caches };

/// From how many bytes on folding pays.
inline constexpr std::size_t kMinFolded = 1024;

/// Whether the processor multiplies polynomials of 512 bit at once (AVX-512 with VPCLMULQDQ). Any context.
[[nodiscard]] bool can_fold() noexcept;

/// Takes all whole stretches of 256 bytes from the front of `from`, copies them to `to` unless `how` is none,
/// and takes them into the register `state` of a CRC-32C. Bytes done. In one stream, as the processor's
/// prefetcher likes it, and as fast as memory. Only if can_fold(), from kMinFolded bytes on; past_caches:
/// with a `to` at a multiple of 64. Real-time. Method: Gopal and others, "Fast CRC Computation for Generic
/// Polynomials Using PCLMULQDQ", Intel 2009.
std::size_t fold_crc32c(ChecksumCopy how, std::byte* to, std::span<const std::byte> from,
                        std::uint32_t& state) noexcept;

}  // namespace plchost
