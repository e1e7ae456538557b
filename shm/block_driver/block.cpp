#include "shm/block_driver/block.hpp"

#include "shm/base/crc32c.hpp"

namespace plchost {

std::string_view to_string(BlockPriority priority) noexcept {
  switch (priority) {
    case BlockPriority::emergency:
      return "emergency";
    case BlockPriority::high:
      return "high";
    case BlockPriority::normal:
      return "normal";
    case BlockPriority::low:
      return "low";
  }
  return "unknown";
}

std::uint32_t checksum_of(const BlockHeader& header) noexcept {
  return crc32c(std::as_bytes(std::span(&header, 1)).subspan(sizeof header.checksum));
}

bool is_sane(const BlockHeader& header) noexcept {
  return header.size <= kMaxBlockSize && header.kind < kBlockKinds && header.priority < kBlockPriorities &&
         header.hops <= kMaxHops && NodeAddress::from_number(header.destination).valid() &&
         NodeAddress::from_number(header.source).valid() &&
         !NodeAddress::from_number(header.source).to_all() && header.channel != 0;
}

std::uint32_t channel_number(std::string_view name) noexcept {
  const std::uint32_t number = crc32c(std::as_bytes(std::span(name)));
  return number == 0 ? 1 : number;
}

}  // namespace plchost
