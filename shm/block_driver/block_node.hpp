#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/block_driver/block_link.hpp"
#include "shm/block_driver/link_gate.hpp"
#include "shm/block_driver/node_directory.hpp"
#include "shm/block_driver/remote_names.hpp"
#include "shm/block_driver/routes.hpp"

namespace plchost {

enum class SendResult : std::uint8_t {
  sent,         ///< it lies in the queue of the next node
  congested,    ///< that queue is full; nothing was sent
  connecting,   ///< the link to the next node is being made: again in the next cycle
  unreachable,  ///< no node has that address, or no route leads there
  invalid,      ///< no such address, or larger than kMaxBlockSize
};

/// Takes a block that is for another host, or for all of them; anything but `sent`: it has not. Called by the
/// router's thread.
using RemoteSink = std::function<SendResult(const BlockHeader&, std::span<const std::byte>)>;
/// Whether a block of so many slots for that address could be taken now. If not it stays where it is, and its
/// sender is told of congestion. Called by the router's thread.
using RemoteRoom = std::function<bool(NodeAddress to, std::uint32_t slots)>;

/// The longest name of a channel, bytes.
inline constexpr std::size_t kMaxChannelName = 63;
[[nodiscard]] Result<void> check_channel_name(std::string_view name);

struct NodeOptions {
  std::string pool;
  std::string base = std::string(kDefaultBlockBase);
  NodeEntry entry;
  std::vector<std::string> neighbours = {};  ///< names of the nodes that it talks to; empty: all
  std::uint8_t hop_limit = kMaxHops;         ///< 1 to kMaxHops
  Duration hold = std::chrono::seconds(1);   ///< a block that is not taken is dropped after that time
  std::uint16_t host_number = 0;             ///< a gateway's: how other hosts call this one; 0: it is none
  RemoteSink remote = {};                    ///< a gateway's: where blocks for other hosts go
  RemoteRoom remote_room = {};               ///< a gateway's; none: there always is
};

/// Of a block, what its sender says.
struct Outgoing {
  NodeAddress to;
  std::uint32_t channel = 0;
  std::uint32_t correlation = 0;
  BlockKind kind = BlockKind::message;
  BlockPriority priority = BlockPriority::normal;
};

/// A node as the tasks of its process see it: they send, and take what has come, without a lock, an
/// allocation or a wait. Its router (BlockRouter) makes links and carries blocks between others.
class BlockNode {
 public:
  /// Joins the directory. Set-up.
  [[nodiscard]] static Result<std::unique_ptr<BlockNode>> join(const NodeOptions& options);
  ~BlockNode();
  BlockNode(const BlockNode&) = delete;
  BlockNode& operator=(const BlockNode&) = delete;

  /// Real-time, any thread. A block for all nodes does not come back to its sender.
  SendResult send(const Outgoing& outgoing, std::span<const std::byte> contents) noexcept;

  /// The next block for a channel of this node: of the highest priority, then the oldest of its sender.
  /// Real-time, any thread.
  TakeResult receive(std::uint32_t channel, std::span<std::byte> buffer, BlockHeader& header) noexcept;

  /// Grows with each block for this node: to poll cheaply, and for soft threads to wait on.
  [[nodiscard]] CountedEvent& arrivals() noexcept { return own_slot().arrivals; }

  /// "packer": on this host; "packer@south": on another one. Real-time. Also asks for the link that leads
  /// there. Node 0: there is no node of that name.
  [[nodiscard]] NodeAddress find(std::string_view name) noexcept;
  /// A block that another host sent, at the gateway that got it. invalid: also one that says that it is of
  /// this host. Any thread.
  SendResult inject(BlockHeader header, std::span<const std::byte> contents) noexcept;

  /// A gateway's: the other hosts that are reached at present, at most kMaxHostRanges; the senders of blocks
  /// for others are told that they are unreachable. Soft threads.
  void set_hosts(std::vector<HostRange> hosts);
  /// A gateway's: the nodes of other hosts, for find(); see RemoteNames::write(). One soft thread.
  void set_remote_nodes(std::span<const RemoteNode> nodes) noexcept;
  /// The counts of the node, besides those of its links.
  [[nodiscard]] NodeCounters& counters() noexcept { return own_slot().counters; }
  /// Its directory was cut short by a stranger. Any context.
  [[nodiscard]] bool lost() const noexcept { return directory_.lost(); }

  /// The number of a channel of this node, which is then in use until close_channel(). already_exists: a
  /// channel of another name has the same number. Set-up.
  [[nodiscard]] Result<std::uint32_t> open_channel(std::string_view name);
  void close_channel(std::uint32_t number);

  /// A number for a request. Real-time, any thread.
  [[nodiscard]] std::uint32_t next_correlation() noexcept {
    return correlations_.fetch_add(1, std::memory_order_relaxed);
  }

  [[nodiscard]] NodeAddress address() const noexcept { return {.host = 0, .node = life_.node}; }
  [[nodiscard]] const std::string& name() const noexcept { return options_.entry.name; }

 private:
  friend class BlockRouter;
  BlockNode(NodeOptions options, NodeDirectory directory, RemoteNames remote_names, const NodeLife& life);
  [[nodiscard]] NodeSlot& own_slot() const noexcept { return directory_.slot(life_.node); }
  [[nodiscard]] bool is_local(NodeAddress address) const noexcept;
  [[nodiscard]] bool is_for_us(NodeAddress address) const noexcept;
  /// The neighbour (or this node) that a block is given to; 0: there is no way.
  [[nodiscard]] std::uint16_t next_hop(NodeAddress to) const noexcept;
  SendResult put(const BlockHeader& header, std::span<const std::byte> contents) noexcept;
  SendResult put_to(std::uint16_t node, const BlockHeader& header,
                    std::span<const std::byte> contents) noexcept;
  void want_link(std::uint16_t node) noexcept;
  Result<void> keep_record();

  const NodeOptions options_;
  NodeDirectory directory_;
  RemoteNames remote_names_;
  const NodeLife life_;
  std::array<LinkGate<OutLink>, kMaxNodes> out_;
  std::array<LinkGate<InLink>, kMaxNodes> in_;
  std::array<std::atomic<std::uint64_t>, kMaxNodes / 64> open_in_{};  // bit of each in_ that is not closed
  std::array<std::atomic<std::uint16_t>, kMaxNodes> next_hops_{};
  // A host range and the neighbour that leads there, in one word: [ first : 16 ][ last : 16 ][ node : 16 ].
  std::array<std::atomic<std::uint64_t>, kMaxHostRoutes> host_routes_{};
  std::array<std::atomic<std::uint64_t>, kMaxNodes / 64> wanted_{};
  std::array<std::atomic<std::uint32_t>, kBlockPriorities> sequences_{};
  std::atomic<std::uint32_t> correlations_{1};
  std::atomic<std::uint32_t> turn_{0};  // which link is looked at first
  std::mutex entry_mutex_;              // soft threads only
  NodeEntry entry_;                     // as it is now
  std::mutex channels_mutex_;           // set-up only
  std::map<std::uint32_t, std::string> channels_;
  std::atomic<bool> has_channels_{false};  // so that blocks for all nodes may be taken here
};

}  // namespace plchost
