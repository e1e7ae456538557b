#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include <control.h>

#include "api/client/topic_reader.hpp"
#include "api/dds/entity.hpp"
#include "api/dds/host_writers.hpp"
#include "api/gateway/block_window.hpp"
#include "api/gateway/host_numbers.hpp"
#include "api/gateway/pending_blocks.hpp"
#include "shm/base/result.hpp"
#include "shm/block_driver/block_router.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

/// The name of the node through which a host's blocks go to other hosts.
inline constexpr const char* kGatewayName = "gateway";

struct GatewayOptions {
  std::string pool;
  std::string base;
  std::string host;
  std::uint16_t number = 0;   ///< of this host, 1 to kMaxHostNumber
  std::int64_t since_ns = 0;  ///< start of the manager, CLOCK_REALTIME
  std::uint64_t epoch = 0;    ///< start of this process, CLOCK_REALTIME
  Duration hold = std::chrono::seconds(1);
};

/// The node of a pool behind which other hosts lie: blocks for them go out over DDS. Blocks from them are
/// checked and go to the nodes of this one. Two threads: that of its router, which never waits for a host,
/// and the one that serves.
class BlockGateway {
 public:
  /// A host that is silent for so long is not reached; it is heard five times in that time.
  static constexpr Duration kSilence = std::chrono::seconds(1);
  static constexpr Duration kBeat = std::chrono::milliseconds(200);
  /// A host announces itself again so often: samples of strangers may push an announcement out of a reader.
  static constexpr Duration kAnnounceAgain = std::chrono::seconds(2);
  static constexpr std::size_t kMostPeers = 256;

  /// `wait_set` waits for what there is to serve; both it and the participant outlive the gateway.
  [[nodiscard]] static Result<std::unique_ptr<BlockGateway>> create(dds_entity_t participant,
                                                                    GatewayOptions options,
                                                                    const WaitSet& wait_set);
  ~BlockGateway();
  BlockGateway(const BlockGateway&) = delete;
  BlockGateway& operator=(const BlockGateway&) = delete;

  /// Does what there is to do at `now`; returns when to be called again, unless it is woken before.
  TimePoint serve(TimePoint now);
  /// A stranger has cut short what it works on: a new one is needed.
  [[nodiscard]] bool lost() const noexcept { return node_->lost(); }

 private:
  /// Another host. The members that both threads use are guarded by mutex_.
  struct Peer {
    HostClaim claim;
    dds::PartitionWriter acks;
    dds::Entity blocks;  // guarded; of the publisher of acks
    dds::Guid writer;
    BlockWindow window;    // guarded
    NodeSet full;          // guarded: takes no blocks for these
    bool reached = false;  // guarded
    std::optional<TimePoint> heard;
    dds::Guid stream;         // the sender of the blocks from there
    std::uint64_t taken = 0;  // the last one of them
    NodeSet told_full;        // of this host, with the last acknowledgement
    bool has_news = false;    // to be acknowledged
  };
  using Peers = std::map<std::uint16_t, std::unique_ptr<Peer>>;

  BlockGateway(dds_entity_t participant, GatewayOptions options);
  Result<void> open_topics(const WaitSet& wait_set);
  Result<void> open_node();

  // The router's thread.
  [[nodiscard]] SendResult give(const BlockHeader& header, std::span<const std::byte> contents);
  [[nodiscard]] SendResult give_to(Peer& peer, const BlockHeader& header,
                                   std::span<const std::byte> contents);
  [[nodiscard]] bool has_room(NodeAddress to, std::uint32_t slots);

  // The serving thread; block_gateway_peers.cpp: the present hosts
  void follow_hosts(TimePoint now);
  [[nodiscard]] bool follow(const plc_BlockHostStatus& host, const dds_sample_info_t& info, TimePoint now);
  void settle_peers(TimePoint now);
  void add_peer(const HostClaim& claim);
  [[nodiscard]] Result<std::unique_ptr<Peer>> open_peer(const HostClaim& claim) const;
  [[nodiscard]] Result<void> open_block_writer(Peer& peer) const;
  void remove_peer(Peers::iterator peer);
  void beat(TimePoint now);
  void look_at(Peer& peer, TimePoint now);
  void renew_writer(Peer& peer);
  void tell_of_numbers(TimePoint now);
  void announce(TimePoint now);
  void publish_names();

  // block_gateway.cpp: their blocks
  void take_acks(TimePoint now);
  void take_blocks(TimePoint now);
  void take(const plc_Block& block, const dds::Guid& writer, TimePoint now);
  void write_block_acks();
  [[nodiscard]] Peer* peer_of(const dds::Guid& writer);
  [[nodiscard]] dds::Guid writer_behind(const dds_sample_info_t& info);
  void count(std::atomic<std::uint64_t> NodeCounters::* counter, std::uint64_t by = 1) noexcept {
    (node_->counters().*counter).fetch_add(by, std::memory_order_relaxed);
  }

  const dds_entity_t participant_;
  const GatewayOptions options_;
  HostNumbers numbers_;
  std::mutex mutex_;
  Peers peers_;  // changed by the serving thread, with the mutex
  dds::Entity subscriber_;
  dds::Entity host_subscriber_;
  dds::HostWriters host_writers_;
  dds::TopicReader hosts_;
  dds::TopicReader blocks_;
  dds::TopicReader acks_;
  dds::PartitionWriter host_writer_;
  std::unordered_map<dds_instance_handle_t, dds::Guid> writers_;  // a cache
  std::unique_ptr<BlockNode> node_;
  std::optional<NodeDirectory> directory_;  // to look at
  std::optional<PendingBlocks> pending_;
  std::vector<std::pair<std::uint16_t, std::string>> announced_;
  std::optional<TimePoint> announced_at_;
  std::map<std::string, std::vector<std::pair<std::uint16_t, std::string>>> names_;  // of each other host
  std::string told_;                                                                 // of the numbers
  std::vector<std::uint16_t> reached_;
  TimePoint next_beat_{};
  std::unique_ptr<BlockRouter> router_;
  std::atomic<bool> stop_{false};
  Thread router_thread_;
};

}  // namespace plchost
