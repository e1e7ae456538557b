#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace plchost {

/// CRC-32C (Castagnoli, as in iSCSI and SCTP) of `bytes`, which follow others with the checksum `so_far`.
/// With the processor's instruction where there is one: some 20 bytes a nanosecond. Real-time.
[[nodiscard]] std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t so_far = 0) noexcept;

/// Copies `from` to `to`, and the checksum of what was copied. The two do not overlap. Real-time.
std::uint32_t copy_with_crc32c(std::byte* to, std::span<const std::byte> from,
                               std::uint32_t so_far = 0) noexcept;

/// The same past the caches, for what another core will read: it is spared taking each line from the cache of
/// this one, and this one asking for it first. Visible to others after the next release store.
std::uint32_t copy_out_with_crc32c(std::byte* to, std::span<const std::byte> from,
                                   std::uint32_t so_far = 0) noexcept;

}  // namespace plchost
