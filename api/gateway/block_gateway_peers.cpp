// Which other hosts there are: see block_gateway.hpp.
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "api/client/met_readers.hpp"
#include "api/dds/samples.hpp"
#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"
#include "api/gateway/block_gateway.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"

namespace plchost {

void BlockGateway::follow_hosts(TimePoint now) {
  bool told = false;
  bool has_new_names = false;
  dds::take_told<plc_BlockHostStatus>(hosts_.reader.get(), host_writers_,
                                      [&](const auto& host, const auto& info) {
                                        told = true;
                                        has_new_names = follow(host, info, now) || has_new_names;
                                      });
  if (told) settle_peers(now);
  if (has_new_names) publish_names();
}

// Whether the names of its nodes are others than before.
bool BlockGateway::follow(const plc_BlockHostStatus& host, const dds_sample_info_t& info, TimePoint now) {
  const std::string name(dds::text_of(host.host));
  // A key belongs to no writer: another host may have disposed of it after this host wrote. None disposes of
  // its own.
  const bool ended = info.instance_state == DDS_IST_NOT_ALIVE_NO_WRITERS || !info.valid_data;
  if (info.instance_state != DDS_IST_ALIVE && ended) {
    numbers_.forget(name, now);
    return names_.erase(name) != 0;
  }
  const dds::Guid writer = dds::writer_of(hosts_.reader.get(), info);
  if (!info.valid_data || writer == dds::Guid{}) return false;
  numbers_.claim({.host = name,
                  .number = host.host_number,
                  .since_ns = host.since_unix_ns,
                  .epoch = host.epoch,
                  .participant = writer.participant()},
                 now);
  std::vector<std::pair<std::uint16_t, std::string>> names;
  for (const plc_BlockNode& node : dds::parts_of(host.nodes)) {
    names.emplace_back(node.node, dds::text_of(node.name));
  }
  return std::exchange(names_[name], names) != names;
}

// Of the hosts that have their numbers.
void BlockGateway::publish_names() {
  std::vector<RemoteNode> nodes;
  for (const auto& [number, peer] : peers_) {
    for (const auto& [node, name] : names_[peer->claim.host]) {
      const NodeAddress address{.host = number, .node = node};
      if (!address.valid() || !check_name("node name", name, kMaxInstanceName)) continue;
      nodes.push_back(RemoteNode::of(peer->claim.host, name, address));
    }
  }
  if (nodes.size() > RemoteNames::kMost) {
    spdlog::warn("blocks: of {} nodes of other hosts {} are found by name", nodes.size(), RemoteNames::kMost);
  }
  node_->set_remote_nodes(nodes);
}

// The peers that there are become those that there shall be.
void BlockGateway::settle_peers(TimePoint now) {
  const auto wanted = numbers_.serves(now) ? numbers_.others() : std::map<std::uint16_t, HostClaim>();
  bool changed = false;
  for (auto peer = peers_.begin(); peer != peers_.end();) {
    const auto same = wanted.find(peer->first);
    const auto next = std::next(peer);
    if (same == wanted.end() || same->second != peer->second->claim) {
      remove_peer(peer);
      changed = true;
    }
    peer = next;
  }
  for (const auto& [number, claim] : wanted) {
    if (peers_.contains(number)) continue;
    add_peer(claim);
    changed = true;
  }
  if (changed) publish_names();
}

Result<void> BlockGateway::open_block_writer(Peer& peer) const {
  // Never waits: how much may be under way is the business of BlockWindow.
  PLCHOST_TRY_ASSIGN(peer.blocks, dds::make_writer(peer.acks.publisher.get(), blocks_.topic.get(),
                                                   dds::qos_of(dds::kBlock)));
  peer.writer = dds::guid_of(peer.blocks.get());
  return {};
}

Result<std::unique_ptr<BlockGateway::Peer>> BlockGateway::open_peer(const HostClaim& claim) const {
  auto peer = std::make_unique<Peer>();
  peer->claim = claim;
  PLCHOST_TRY_ASSIGN(peer->acks,
                     dds::open_writer(participant_, dds::block_partition(claim.host, options_.host),
                                      acks_.topic.get(), dds::qos_of(dds::kBlockAck)));
  PLCHOST_TRY(open_block_writer(*peer));
  peer->has_news = true;  // it waits to hear of this host
  return peer;
}

void BlockGateway::add_peer(const HostClaim& claim) {
  if (peers_.size() >= kMostPeers) {
    spdlog::warn("blocks: host '{}' is one too many: {} are served", claim.host, kMostPeers);
    return;
  }
  auto peer = open_peer(claim);
  if (!peer) return spdlog::error("blocks: host '{}': {}", claim.host, peer.error().describe());
  const std::scoped_lock lock(mutex_);
  peers_.emplace(claim.number, *std::move(peer));
}

void BlockGateway::remove_peer(Peers::iterator peer) {
  std::unique_ptr<Peer> gone;
  {
    const std::scoped_lock lock(mutex_);
    gone = std::move(peer->second);
    peers_.erase(peer);
  }
  count(&NodeCounters::lost, gone->window.under_way());
}

// Its blocks were sent and never taken, as after a cut that only one side has noticed: a fresh writer begins
// a fresh sequence.
void BlockGateway::renew_writer(Peer& peer) {
  spdlog::warn("blocks: host '{}' is heard, but {} lost", peer.claim.host,
               count_text(peer.window.under_way(), "block for it is", "blocks for it are"));
  count(&NodeCounters::lost, peer.window.under_way());
  peer.window = BlockWindow();
  peer.reached = false;  // until the new one has met its reader
  if (auto opened = open_block_writer(peer); !opened) {
    spdlog::error("blocks: host '{}': {}", peer.claim.host, opened.error().describe());
  }
}

void BlockGateway::look_at(Peer& peer, TimePoint now) {
  const bool heard = peer.heard && now - *peer.heard <= kSilence;
  const std::scoped_lock lock(mutex_);
  const bool was_reached = peer.reached;
  peer.reached = heard && has_reader(peer.blocks.get());
  if (!heard) peer.full = {};
  // After a silence what is under way has its time again.
  if (!was_reached) peer.window.be_patient(now);
  if (peer.reached && peer.window.stalled(now)) renew_writer(peer);
  peer.has_news = true;
}

void BlockGateway::beat(TimePoint now) {
  settle_peers(now);
  tell_of_numbers(now);
  std::vector<std::uint16_t> reached;
  for (const auto& [number, peer] : peers_) {
    look_at(*peer, now);
    if (peer->reached) reached.push_back(number);
  }
  if (reached != reached_) {
    node_->set_hosts(ranges_of(reached));
    spdlog::info("blocks: {}",
                 reached.empty() ? std::string("no other host is reached")
                                 : fmt::format("other hosts that are reached: {}", fmt::join(reached, ", ")));
    reached_ = std::move(reached);
  }
  announce(now);
}

// Once for each change.
void BlockGateway::tell_of_numbers(TimePoint now) {
  std::string problem;
  if (const auto other = numbers_.ahead()) {
    problem = fmt::format(
        "host '{}' has used [blocks] host_number {} longer than this host, which sends and takes no blocks "
        "of "
        "other hosts: give one of the two another number",
        other->host, options_.number);
  } else if (!numbers_.serves(now)) {
    return;  // the grace time
  } else {
    for (const HostClaim& late : numbers_.behind()) {
      problem += fmt::format(
          "{}host '{}' claims number {}, which this host has: it gets no blocks. Give it another "
          "[blocks] host_number",
          problem.empty() ? "" : "; ", late.host, options_.number);
    }
  }
  if (problem == told_) return;
  if (problem.empty()) {
    spdlog::info("blocks: number {} is only this host's now", options_.number);
  } else {
    spdlog::error("blocks: {}", problem);
  }
  told_ = std::move(problem);
}

void BlockGateway::announce(TimePoint now) {
  std::vector<std::pair<std::uint16_t, std::string>> nodes;
  for (std::uint16_t node = 1; node <= kMaxNodes; ++node) {
    if (const auto record = directory_->record(node)) nodes.emplace_back(node, record->name.view());
  }
  if (announced_at_ && now - *announced_at_ < kAnnounceAgain && nodes == announced_) return;
  plc_BlockHostStatus sample{};
  dds::copy_text(sample.host, options_.host);
  sample.epoch = options_.epoch;
  sample.host_number = options_.number;
  sample.since_unix_ns = options_.since_ns;
  std::vector<plc_BlockNode> named(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    named[i].node = nodes[i].first;
    dds::copy_text(named[i].name, nodes[i].second);
  }
  dds::lend(sample.nodes, named);
  const bool written = dds_write(host_writer_.writer.get(), &sample) == DDS_RETCODE_OK;
  announced_at_ = written ? std::optional(now) : std::nullopt;
  announced_ = std::move(nodes);
}

}  // namespace plchost
