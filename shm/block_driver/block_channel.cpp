#include "shm/block_driver/block_channel.hpp"

namespace plchost {

Result<BlockChannel> BlockChannel::open(BlockNode& node, std::string_view name) {
  PLCHOST_TRY_ASSIGN(const auto number, node.open_channel(name));
  return BlockChannel(node, number);
}

SendResult BlockChannel::send(NodeAddress to, std::span<const std::byte> contents,
                              BlockPriority priority) noexcept {
  return node_->send({.to = to, .channel = number_, .priority = priority}, contents);
}

SendResult BlockChannel::request(NodeAddress to, std::span<const std::byte> contents,
                                 std::uint32_t& correlation, BlockPriority priority) noexcept {
  correlation = node_->next_correlation();
  return node_->send({.to = to,
                      .channel = number_,
                      .correlation = correlation,
                      .kind = BlockKind::request,
                      .priority = priority},
                     contents);
}

SendResult BlockChannel::reply(const Received& request, std::span<const std::byte> contents) noexcept {
  return node_->send({.to = request.from,
                      .channel = number_,
                      .correlation = request.correlation,
                      .kind = BlockKind::reply,
                      .priority = request.priority},
                     contents);
}

TakeResult BlockChannel::receive(std::span<std::byte> buffer, Received& received) noexcept {
  const std::uint64_t arrivals = node_->arrivals().count();
  if (empty_at_.load(std::memory_order_relaxed) == arrivals) return TakeResult::none;
  BlockHeader header;
  const TakeResult result = node_->receive(number_, buffer, header);
  if (result == TakeResult::none) {
    empty_at_.store(arrivals, std::memory_order_relaxed);
    return result;
  }
  received = {.size = header.size,
              .from = NodeAddress::from_number(header.source),
              .kind = static_cast<BlockKind>(header.kind),
              .priority = static_cast<BlockPriority>(header.priority),
              .correlation = header.correlation};
  return result;
}

}  // namespace plchost
