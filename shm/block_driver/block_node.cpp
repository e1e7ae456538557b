#include "shm/block_driver/block_node.hpp"

#include <algorithm>
#include <bit>

#include <fmt/format.h>

namespace plchost {

namespace {

constexpr std::size_t kPage = 4096;

// A caller's bad pointer is to fault here, before anything of the queues is touched. A task that is stopped
// with slots in its hand would keep them from everybody until the link is made anew.
void touch_to_read(std::span<const std::byte> bytes) noexcept {
  const volatile std::byte* const at = bytes.data();
  for (std::size_t i = 0; i < bytes.size(); i += kPage) (void)at[i];
  if (!bytes.empty()) (void)at[bytes.size() - 1];
}

void touch_to_write(std::span<std::byte> bytes) noexcept {
  volatile std::byte* const at = bytes.data();
  for (std::size_t i = 0; i < bytes.size(); i += kPage) at[i] = at[i];
  if (!bytes.empty()) at[bytes.size() - 1] = at[bytes.size() - 1];
}

}  // namespace

Result<void> check_channel_name(std::string_view name) {
  return check_name("channel name", name, kMaxChannelName);
}

BlockNode::BlockNode(NodeOptions options, NodeDirectory directory, RemoteNames remote_names,
                     const NodeLife& life)
    : options_(std::move(options)),
      directory_(std::move(directory)),
      remote_names_(std::move(remote_names)),
      life_(life),
      entry_(options_.entry) {}

BlockNode::~BlockNode() {
  directory_.leave(life_);
}

Result<std::unique_ptr<BlockNode>> BlockNode::join(const NodeOptions& options) {
  if (options.hop_limit < 1 || options.hop_limit > kMaxHops) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("a hop limit of {} is not possible: 1 to {} is", options.hop_limit, kMaxHops));
  }
  PLCHOST_TRY_ASSIGN(auto directory, NodeDirectory::open(options.pool, options.base));
  PLCHOST_TRY_ASSIGN(auto remote_names, RemoteNames::open(options.pool, options.base));
  PLCHOST_TRY_ASSIGN(const auto life, directory.join(options.entry));
  if (options.host_number != 0) {
    directory.layout().host_number.store(options.host_number, std::memory_order_relaxed);
  }
  return std::unique_ptr<BlockNode>(
      new BlockNode(options, std::move(directory), std::move(remote_names), life));
}

bool BlockNode::is_local(NodeAddress address) const noexcept {
  return address.host == 0 || address.host == NodeAddress::kAllHosts ||
         address.host == directory_.layout().host_number.load(std::memory_order_relaxed);
}

bool BlockNode::is_for_us(NodeAddress address) const noexcept {
  return address.node == life_.node && is_local(address);
}

std::uint16_t BlockNode::next_hop(NodeAddress to) const noexcept {
  if (is_local(to)) {
    // Its own router spreads what is for all nodes.
    if (to.to_all() || to.node == life_.node) return life_.node;
    return next_hops_[to.node - 1U].load(std::memory_order_relaxed);
  }
  for (const auto& route : host_routes_) {
    const std::uint64_t word = route.load(std::memory_order_relaxed);
    const auto first = static_cast<std::uint16_t>(word >> 32);
    const auto last = static_cast<std::uint16_t>(word >> 16);
    if (word != 0 && to.host >= first && to.host <= last) return static_cast<std::uint16_t>(word);
  }
  return 0;
}

void BlockNode::want_link(std::uint16_t node) noexcept {
  const std::uint64_t bit = std::uint64_t{1} << ((node - 1U) % 64);
  std::atomic<std::uint64_t>& word = wanted_[(node - 1U) / 64];
  if ((word.load(std::memory_order_relaxed) & bit) != 0) return;  // asked for already
  word.fetch_or(bit, std::memory_order_release);
  own_slot().work.post();
}

SendResult BlockNode::put_to(std::uint16_t node, const BlockHeader& header,
                             std::span<const std::byte> contents) noexcept {
  const auto link = out_[node - 1U].enter();
  if (!link) {
    own_slot().counters.unconnected.fetch_add(1, std::memory_order_relaxed);
    want_link(node);
    return SendResult::connecting;
  }
  switch (link->put(header, contents)) {
    case PutResult::full:
      return SendResult::congested;
    case PutResult::broken:
      want_link(node);
      return SendResult::connecting;
    case PutResult::put:
      break;
  }
  NodeSlot& slot = directory_.slot(node);
  const NodeAddress to = NodeAddress::from_number(header.destination);
  if (to.node == node && is_local(to)) {
    slot.arrivals.post();
  } else {
    slot.work.post();
  }
  return SendResult::sent;
}

SendResult BlockNode::put(const BlockHeader& header, std::span<const std::byte> contents) noexcept {
  const std::uint16_t node = next_hop(NodeAddress::from_number(header.destination));
  if (node == 0 || node > kMaxNodes) return SendResult::unreachable;
  return put_to(node, header, contents);
}

SendResult BlockNode::send(const Outgoing& outgoing, std::span<const std::byte> contents) noexcept {
  if (!outgoing.to.valid() || contents.size() > kMaxBlockSize || outgoing.channel == 0 ||
      static_cast<std::size_t>(outgoing.priority) >= kBlockPriorities) {
    return SendResult::invalid;
  }
  touch_to_read(contents);
  BlockHeader header;
  header.destination = outgoing.to.number();
  header.source = address().number();
  header.channel = outgoing.channel;
  header.correlation = outgoing.correlation;
  header.epoch = life_.generation;
  header.kind = static_cast<std::uint8_t>(outgoing.kind);
  header.priority = static_cast<std::uint8_t>(outgoing.priority);
  if (outgoing.to.to_all()) {
    header.sequence = sequences_[header.priority].fetch_add(1, std::memory_order_relaxed);
  }
  return put(header, contents);
}

TakeResult BlockNode::receive(std::uint32_t channel, std::span<std::byte> buffer,
                              BlockHeader& header) noexcept {
  touch_to_write(buffer);
  const auto wants = [&](const BlockTag& tag, std::uint32_t) {
    return tag.channel == channel && is_for_us(tag.destination);
  };
  std::array<std::uint8_t, kMaxNodes> open;
  std::uint32_t count = 0;
  for (std::size_t word = 0; word < open_in_.size(); ++word) {
    for (std::uint64_t bits = open_in_[word].load(std::memory_order_acquire); bits != 0; bits &= bits - 1) {
      open[count++] = static_cast<std::uint8_t>(word * 64 + static_cast<unsigned>(std::countr_zero(bits)));
    }
  }
  // Links take turns, so that none of them starves another one of its priority.
  const std::uint32_t first = turn_.fetch_add(1, std::memory_order_relaxed);
  for (std::size_t priority = 0; priority < kBlockPriorities; ++priority) {
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto link = in_[open[(first + i) % count]].enter();
      if (!link) continue;
      const TakeResult result = link->take(priority, wants, buffer, header);
      if (result != TakeResult::none) return result;
    }
  }
  return TakeResult::none;
}

SendResult BlockNode::inject(BlockHeader header, std::span<const std::byte> contents) noexcept {
  if (!is_sane(header) || contents.size() > kMaxBlockSize || header.hosts >= kMaxHops ||
      is_local(NodeAddress::from_number(header.source))) {
    return SendResult::invalid;
  }
  // From here on it is a block of this host that came in at this node.
  NodeAddress to = NodeAddress::from_number(header.destination);
  to.host = 0;
  header.destination = to.number();
  header.hosts = static_cast<std::uint8_t>(header.hosts + 1);
  header.hops = 1;
  header.path = {static_cast<std::uint8_t>(life_.node)};
  return put(header, contents);
}

void BlockNode::set_hosts(std::vector<HostRange> hosts) {
  {
    const std::scoped_lock lock(entry_mutex_);
    entry_.hosts = std::move(hosts);
  }
  (void)keep_record();  // its router does it again, and tells why not
}

void BlockNode::set_remote_nodes(std::span<const RemoteNode> nodes) noexcept {
  remote_names_.write(nodes);
}

// A part that a stranger has changed is written again.
Result<void> BlockNode::keep_record() {
  const std::scoped_lock lock(entry_mutex_);
  if (options_.host_number != 0) {
    directory_.layout().host_number.store(options_.host_number, std::memory_order_relaxed);
  }
  return directory_.keep(life_, entry_);
}

Result<std::uint32_t> BlockNode::open_channel(std::string_view name) {
  PLCHOST_TRY(check_channel_name(name));
  const std::uint32_t number = channel_number(name);
  const std::scoped_lock lock(channels_mutex_);
  const auto [known, is_new] = channels_.try_emplace(number, name);
  has_channels_.store(true, std::memory_order_release);
  if (is_new || known->second == name) return number;
  return failure(ErrorCode::already_exists,
                 fmt::format("channel '{}' has the same number as '{}', which is open: choose another name",
                             name, known->second));
}

void BlockNode::close_channel(std::uint32_t number) {
  const std::scoped_lock lock(channels_mutex_);
  channels_.erase(number);
  has_channels_.store(!channels_.empty(), std::memory_order_release);
}

NodeAddress BlockNode::find(std::string_view name) noexcept {
  NodeAddress found;
  if (const auto remote = remote_names_.find(name)) {
    found = *remote;
  } else if (const auto node = directory_.find(name)) {
    found.node = *node;
  } else {
    return {};
  }
  const std::uint16_t hop = next_hop(found);
  if (hop != 0 && hop <= kMaxNodes && out_[hop - 1U].closed()) want_link(hop);
  return found;
}

}  // namespace plchost
