#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/block_driver/block_node.hpp"
#include "shm/block_driver/duplicate_filter.hpp"
#include "shm/block_driver/topology.hpp"

namespace plchost {

/// The soft side of a node, one thread. It makes and opens links, sees peers end, carries blocks between
/// other nodes, spreads those for all, and drops blocks that are not taken. Real-time tasks never wait for
/// it; without it links that are open go on working.
class BlockRouter {
 public:
  /// Also opens the node's link to itself. Set-up. `node` outlives the router.
  [[nodiscard]] static Result<std::unique_ptr<BlockRouter>> create(BlockNode& node);

  /// Does what there is to do at `now`; returns when to be called again, unless there is work before.
  TimePoint serve(TimePoint now);

  /// Serves until `stop`; the thread that sets it then calls wake().
  void run(const std::atomic<bool>& stop);
  void wake() noexcept { node_.own_slot().work.nudge(); }

 private:
  explicit BlockRouter(BlockNode& node);

  // router_links.cpp: the present nodes, and the links to them
  void tick(TimePoint now);
  void look_for_the_dead();
  void refresh();
  [[nodiscard]] NodeSet willing() const;
  void publish_routes();
  void publish_host_routes();
  void drop_stale_links();
  void open_incoming();
  [[nodiscard]] bool open_from(std::uint16_t node);
  void connect_wanted();
  Result<void> connect(std::uint16_t node);
  void set_open(std::uint16_t node, bool open) noexcept;
  void tidy(TimePoint now);
  void tell(const Error& problem);

  // block_router.cpp: the blocks
  [[nodiscard]] bool relay();
  [[nodiscard]] bool can_take(const BlockTag& tag, std::size_t priority, std::uint32_t slots);
  void handle(const BlockHeader& header, std::span<const std::byte> contents);
  void forward(BlockHeader header, std::span<const std::byte> contents);
  void spread(const BlockHeader& header, std::span<const std::byte> contents);
  void give_to(std::uint16_t node, const BlockHeader& header, std::span<const std::byte> contents);
  void give_to_remote(BlockHeader header, std::span<const std::byte> contents);
  [[nodiscard]] bool is_gateway_for(NodeAddress address) const noexcept;
  [[nodiscard]] NodeCounters& counters() noexcept { return node_.own_slot().counters; }

  BlockNode& node_;
  const Duration period_;  // of tick()
  Topology topology_;
  DuplicateFilter filter_;
  std::array<NodeLife, kMaxNodes> lives_{};  // of the nodes that are there, as of the last refresh
  std::uint64_t changes_seen_ = 0;
  TimePoint next_tick_{};
  std::uint32_t ticks_ = 0;
  std::uint16_t suspect_ = 0;  // the node to look at next
  std::vector<std::byte> buffer_;
  std::vector<std::uint32_t> held_up_;  // numbers of addresses, while relay() looks through a queue
  std::string last_problem_;
};

}  // namespace plchost
