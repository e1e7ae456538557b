#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <control.h>

#include "shm/block_driver/block.hpp"

namespace plchost {

/// A block as it travels between hosts. The sample points to `contents`.
[[nodiscard]] plc_Block block_sample(const BlockHeader& header, std::span<const std::byte> contents,
                                     std::uint64_t sequence_number) noexcept;

/// And back: with the sender's host as its source. Nothing: it is not valid, or not of the host `from`, or
/// not for the host `own`.
[[nodiscard]] std::optional<BlockHeader> block_header(const plc_Block& sample, std::uint16_t from,
                                                      std::uint16_t own) noexcept;
[[nodiscard]] std::span<const std::byte> block_contents(const plc_Block& sample) noexcept;

}  // namespace plchost
