#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>

#include "shm/block_driver/node_address.hpp"

namespace plchost {

/// The largest block, bytes.
inline constexpr std::size_t kMaxBlockSize = 65536;

/// Of two blocks that wait, the one of the higher priority is received first; each has queues of its own.
enum class BlockPriority : std::uint8_t { emergency = 0, high = 1, normal = 2, low = 3 };
inline constexpr std::size_t kBlockPriorities = 4;
[[nodiscard]] std::string_view to_string(BlockPriority priority) noexcept;

enum class BlockKind : std::uint8_t { message = 0, request = 1, reply = 2 };
inline constexpr std::uint8_t kBlockKinds = 3;

/// So many links a block goes at most.
inline constexpr std::uint8_t kMaxHops = 8;

/// The header of a block, in shared memory and between hosts.
struct BlockHeader {
  std::uint32_t checksum = 0;  ///< CRC-32C of all that follows, contents included
  std::uint32_t size = 0;      ///< of the contents, bytes: at most kMaxBlockSize
  std::uint32_t destination = 0;
  std::uint32_t source = 0;
  std::uint32_t channel = 0;                  ///< channel_number() of the channel's name
  std::uint32_t correlation = 0;              ///< of a request, and of the reply to it
  std::uint32_t sequence = 0;                 ///< counts the source's blocks for all nodes, of each priority
  std::uint32_t epoch = 0;                    ///< the source's generation: one life of its process
  std::uint8_t kind = 0;                      ///< a BlockKind
  std::uint8_t priority = 0;                  ///< a BlockPriority
  std::uint8_t hops = 0;                      ///< links that it has come, without the last one
  std::uint8_t hosts = 0;                     ///< hosts that it has come through
  std::array<std::uint8_t, kMaxHops> path{};  ///< the nodes of this host that have forwarded it
  std::array<std::uint32_t, 5> reserved{};    ///< the contents begin with a cache line of their own

  bool operator==(const BlockHeader&) const = default;
};
static_assert(sizeof(BlockHeader) == 64 && std::is_trivially_copyable_v<BlockHeader>);

/// The checksum of a header, with which that of the contents begins. Real-time.
[[nodiscard]] std::uint32_t checksum_of(const BlockHeader& header) noexcept;

/// Whether the fields have values that there are: size, kind, priority, hops, addresses. Real-time.
[[nodiscard]] bool is_sane(const BlockHeader& header) noexcept;

/// The number by which blocks name a channel: never 0. Real-time.
[[nodiscard]] std::uint32_t channel_number(std::string_view name) noexcept;

}  // namespace plchost
