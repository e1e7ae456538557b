#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <string_view>

#include "shm/block_driver/block_node.hpp"

namespace plchost {

/// A block that a channel has received.
struct Received {
  std::size_t size = 0;  ///< of the contents, which lie at the beginning of the buffer; bytes
  NodeAddress from;
  BlockKind kind = BlockKind::message;
  BlockPriority priority = BlockPriority::normal;
  std::uint32_t correlation = 0;  ///< of a request, and of the reply to it
};

/// A named place of a node where blocks come in, and from which they go to the channels of the same name of
/// other nodes. Any task may use it, several may at once: each block is had by one of them. All but open() is
/// real-time: no allocation, no lock, no wait.
class BlockChannel {
 public:
  /// `name`: 1 to kMaxChannelName characters, see check_name. `node` outlives the channel. Set-up.
  [[nodiscard]] static Result<BlockChannel> open(BlockNode& node, std::string_view name);
  BlockChannel(BlockChannel&& other) noexcept : node_(other.node_), number_(other.number_) {}
  BlockChannel& operator=(BlockChannel&&) = delete;
  /// Another one of the same number can be opened; this one is not to be used any more. Set-up.
  void close() { node_->close_channel(number_); }

  SendResult send(NodeAddress to, std::span<const std::byte> contents,
                  BlockPriority priority = BlockPriority::normal) noexcept;
  /// `correlation` is the number by which the reply is known.
  SendResult request(NodeAddress to, std::span<const std::byte> contents, std::uint32_t& correlation,
                     BlockPriority priority = BlockPriority::normal) noexcept;
  /// Of the same priority as the request.
  SendResult reply(const Received& request, std::span<const std::byte> contents) noexcept;

  /// too_small: `received.size` tells the size that is needed; the block waits on.
  TakeResult receive(std::span<std::byte> buffer, Received& received) noexcept;

  [[nodiscard]] BlockNode& node() const noexcept { return *node_; }

 private:
  BlockChannel(BlockNode& node, std::uint32_t number) noexcept : node_(&node), number_(number) {}

  BlockNode* node_;
  std::uint32_t number_;
  std::atomic<std::uint64_t> empty_at_{~std::uint64_t{0}};  // arrivals of the node when there was nothing
};

}  // namespace plchost
