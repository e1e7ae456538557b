#include "api/gateway/block_gateway.hpp"

#include <algorithm>

#include "api/dds/samples.hpp"
#include "api/dds/topics.hpp"
#include "api/gateway/block_sample.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

constexpr Duration kRetryPending = std::chrono::milliseconds(1);
constexpr std::size_t kMostWritersKnown = 1024;

}  // namespace

BlockGateway::BlockGateway(dds_entity_t participant, GatewayOptions options)
    : participant_(participant),
      options_(std::move(options)),
      numbers_({.host = options_.host,
                .number = options_.number,
                .since_ns = options_.since_ns,
                .epoch = options_.epoch,
                .participant = {}}) {}

BlockGateway::~BlockGateway() {
  stop_.store(true, std::memory_order_release);
  if (router_thread_.joinable()) router_->wake();
  router_thread_.join();
}

Result<std::unique_ptr<BlockGateway>> BlockGateway::create(dds_entity_t participant, GatewayOptions options,
                                                           const WaitSet& wait_set) {
  std::unique_ptr<BlockGateway> gateway(new BlockGateway(participant, std::move(options)));
  PLCHOST_TRY(in_step("gateway", gateway->open_node()));
  PLCHOST_TRY(in_step("gateway", gateway->open_topics(wait_set)));
  gateway->announce(MonotonicClock::now());
  return gateway;
}

Result<void> BlockGateway::open_node() {
  NodeOptions options{.pool = options_.pool, .base = options_.base, .entry = {.name = kGatewayName}};
  options.hold = options_.hold;
  options.host_number = options_.number;
  options.remote = [this](const BlockHeader& header, std::span<const std::byte> contents) {
    return give(header, contents);
  };
  options.remote_room = [this](NodeAddress to, std::uint32_t slots) { return has_room(to, slots); };
  PLCHOST_TRY_ASSIGN(node_, BlockNode::join(options));
  PLCHOST_TRY_ASSIGN(auto directory, NodeDirectory::open_to_read(options_.pool, options_.base));
  directory_.emplace(std::move(directory));
  pending_.emplace([this](const BlockHeader& header,
                          std::span<const std::byte> contents) { return node_->inject(header, contents); },
                   options_.hold, node_->counters());
  PLCHOST_TRY_ASSIGN(router_, BlockRouter::create(*node_));
  PLCHOST_TRY_ASSIGN(router_thread_, Thread::start("blocks", {}, [this] { router_->run(stop_); }));
  return {};
}

Result<void> BlockGateway::open_topics(const WaitSet& wait_set) {
  PLCHOST_TRY_ASSIGN(subscriber_,
                     dds::make_subscriber(participant_, dds::block_partition(options_.host, dds::kAllHosts)));
  PLCHOST_TRY_ASSIGN(host_subscriber_,
                     dds::make_subscriber(participant_, dds::status_partition(dds::kAllHosts)));
  const auto open = [&](const dds::Entity& from, const dds::TopicInfo& topic, const dds::Qos& qos) {
    return open_reader(participant_, from.get(), topic, qos, wait_set);
  };
  PLCHOST_TRY_ASSIGN(hosts_,
                     open(host_subscriber_, dds::kBlockHostStatus, dds::shown_qos(dds::kBlockHostStatus)));
  PLCHOST_TRY_ASSIGN(blocks_, open(subscriber_, dds::kBlock, dds::bounded_qos(dds::kBlock)));
  PLCHOST_TRY_ASSIGN(acks_, open(subscriber_, dds::kBlockAck, dds::shown_qos(dds::kBlockAck)));
  PLCHOST_TRY_ASSIGN(host_writer_, dds::open_writer(participant_, dds::status_partition(options_.host),
                                                    hosts_.topic.get(), dds::qos_of(dds::kBlockHostStatus)));
  return {};
}

TimePoint BlockGateway::serve(TimePoint now) {
  follow_hosts(now);
  take_acks(now);
  take_blocks(now);
  pending_->retry(now);
  if (now >= next_beat_) {
    beat(now);
    next_beat_ = now + kBeat;
  }
  write_block_acks();
  return pending_->empty() ? next_beat_ : std::min(next_beat_, now + kRetryPending);
}

bool BlockGateway::has_room(NodeAddress to, std::uint32_t slots) {
  const std::scoped_lock lock(mutex_);
  const auto found = peers_.find(to.host);
  if (found == peers_.end() || !found->second->reached) return true;  // to be dropped
  const Peer& peer = *found->second;
  return peer.window.has_room(slots * kSlotSize) && (to.to_all() || !peer.full[to.node - 1U]);
}

SendResult BlockGateway::give(const BlockHeader& header, std::span<const std::byte> contents) {
  const NodeAddress to = NodeAddress::from_number(header.destination);
  // Each host sends for its own nodes only.
  if (NodeAddress::from_number(header.source).host != options_.number) return SendResult::invalid;
  const std::scoped_lock lock(mutex_);
  if (to.host != NodeAddress::kAllHosts) {
    const auto found = peers_.find(to.host);
    return found == peers_.end() ? SendResult::unreachable : give_to(*found->second, header, contents);
  }
  bool all = true;
  for (const auto& [number, peer] : peers_) {
    if (peer->reached) all = give_to(*peer, header, contents) == SendResult::sent && all;
  }
  return all ? SendResult::sent : SendResult::congested;
}

SendResult BlockGateway::give_to(Peer& peer, const BlockHeader& header, std::span<const std::byte> contents) {
  if (!peer.reached) return SendResult::unreachable;
  if (!peer.window.has_room(contents.size())) return SendResult::congested;
  const plc_Block sample = block_sample(header, contents, peer.window.next());
  if (dds_write(peer.blocks.get(), &sample) != DDS_RETCODE_OK) return SendResult::congested;
  peer.window.add(contents.size(), MonotonicClock::now());
  return SendResult::sent;
}

// Looked up once for each writer: it costs a copy of all that was discovered of it.
dds::Guid BlockGateway::writer_behind(const dds_sample_info_t& info) {
  if (const auto known = writers_.find(info.publication_handle); known != writers_.end())
    return known->second;
  const dds::Guid writer = dds::writer_of(blocks_.reader.get(), info);
  if (writers_.size() >= kMostWritersKnown) writers_.clear();
  if (writer != dds::Guid{}) writers_.emplace(info.publication_handle, writer);
  return writer;
}

BlockGateway::Peer* BlockGateway::peer_of(const dds::Guid& writer) {
  const dds::Guid participant = writer.participant();
  const auto found = std::ranges::find_if(
      peers_, [&](const auto& peer) { return peer.second->claim.participant == participant; });
  return found == peers_.end() ? nullptr : found->second.get();
}

void BlockGateway::take_acks(TimePoint now) {
  bool news = false;
  dds::take_valid<plc_BlockAck>(acks_.reader.get(), [&](const plc_BlockAck& ack, const auto& info) {
    Peer* const peer = peer_of(dds::writer_of(acks_.reader.get(), info));
    if (peer == nullptr || ack.from_host != peer->claim.number) return;
    peer->heard = now;
    const std::scoped_lock lock(mutex_);
    const NodeSet full = NodeSet(ack.full_nodes[0]) | NodeSet(ack.full_nodes[1]) << 64;
    news = news || (peer->full & ~full).any();
    peer->full = full;
    if (dds::Guid::from(ack.writer_guid) != peer->writer) return;
    news = peer->window.acknowledge(ack.sequence_number, now) || news;
  });
  if (news) router_->wake();
}

void BlockGateway::take_blocks(TimePoint now) {
  constexpr std::size_t kAtOnce = 32;
  dds::take_valid<plc_Block, kAtOnce>(blocks_.reader.get(), [&](const plc_Block& block, const auto& info) {
    take(block, writer_behind(info), now);
  });
}

void BlockGateway::take(const plc_Block& block, const dds::Guid& writer, TimePoint now) {
  Peer* const peer = peer_of(writer);
  if (peer == nullptr) return count(&NodeCounters::refused);  // it has no number, or not that one
  if (writer != peer->stream) {
    peer->stream = writer;
    peer->taken = block.sequence_number - 1;
  }
  if (block.sequence_number <= peer->taken) return count(&NodeCounters::duplicates);
  // No more can be on their way: a larger gap is a stranger's.
  const std::uint64_t gap = block.sequence_number - peer->taken - 1;
  count(&NodeCounters::lost, std::min<std::uint64_t>(gap, BlockWindow::kMostBlocks));
  peer->taken = block.sequence_number;
  peer->has_news = true;
  const auto header = block_header(block, peer->claim.number, options_.number);
  if (!header) return count(&NodeCounters::refused);
  pending_->take(*header, block_contents(block), now);
}

void BlockGateway::write_block_acks() {
  const NodeSet full = pending_->full();
  constexpr NodeSet kLow(~std::uint64_t{0});
  for (const auto& [number, peer] : peers_) {
    // It sends nothing to a full node, so no block of its own would tell it that the node takes blocks again.
    const bool has_room_again = (peer->told_full & ~full).any();
    if (!peer->has_news && !has_room_again) continue;
    plc_BlockAck ack{};
    ack.from_host = options_.number;
    peer->stream.copy_to(ack.writer_guid);
    ack.sequence_number = peer->taken;
    ack.full_nodes[0] = (full & kLow).to_ullong();
    ack.full_nodes[1] = (full >> 64).to_ullong();
    // One that cannot be written now is with the next beat.
    if (dds_write(peer->acks.writer.get(), &ack) != DDS_RETCODE_OK) continue;
    peer->has_news = false;
    peer->told_full = full;
  }
}

}  // namespace plchost
