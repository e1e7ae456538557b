#include "shm/block_driver/block_router.hpp"

#include <algorithm>

namespace plchost {

namespace {

// How soon to look again after a block that had to stay where it is, because the next queue is full.
constexpr Duration kRetry = std::chrono::milliseconds(1);
constexpr Duration kLongestPeriod = std::chrono::milliseconds(100);

void count_in(std::atomic<std::uint64_t>& counter) noexcept {
  counter.fetch_add(1, std::memory_order_relaxed);
}

bool has_passed(const BlockHeader& header, std::uint16_t node) noexcept {
  const auto passed = std::span(header.path).first(header.hops);
  return std::ranges::find(passed, static_cast<std::uint8_t>(node)) != passed.end();
}

}  // namespace

BlockRouter::BlockRouter(BlockNode& node)
    : node_(node), period_(std::min(node.options_.hold / 10, kLongestPeriod)), buffer_(kMaxBlockSize) {}

Result<std::unique_ptr<BlockRouter>> BlockRouter::create(BlockNode& node) {
  std::unique_ptr<BlockRouter> router(new BlockRouter(node));
  router->refresh();
  PLCHOST_TRY(router->connect(node.life_.node));
  router->open_incoming();
  return router;
}

TimePoint BlockRouter::serve(TimePoint now) {
  if (node_.directory_.layout().changes.load(std::memory_order_acquire) != changes_seen_) refresh();
  open_incoming();
  connect_wanted();
  const bool all_done = relay();
  if (now >= next_tick_) {
    tick(now);
    next_tick_ = now + period_;
  }
  return all_done ? next_tick_ : std::min(next_tick_, now + kRetry);
}

void BlockRouter::run(const std::atomic<bool>& stop) {
  while (!stop.load(std::memory_order_acquire)) {
    const CountedEvent::Snapshot seen = node_.own_slot().work.snapshot();
    const TimePoint next = serve(MonotonicClock::now());
    if (stop.load(std::memory_order_acquire)) return;
    node_.own_slot().work.wait(seen, next);
  }
}

// Takes what is not for this node. false: something must stay for now.
bool BlockRouter::relay() {
  bool all_done = true;
  BlockHeader header;
  for (std::size_t priority = 0; priority < kBlockPriorities; ++priority) {
    // One that stays holds up those behind it to the same address, also if there is room by now, or if they
    // are shorter: none overtakes another one.
    const auto wants = [&](const BlockTag& tag, std::uint32_t slots) {
      if (node_.is_for_us(tag.destination)) return false;
      if (std::ranges::find(held_up_, tag.destination.number()) != held_up_.end()) return false;
      const bool can = can_take(tag, priority, slots);
      if (!can) held_up_.push_back(tag.destination.number());
      all_done = all_done && can;
      return can;
    };
    for (auto& gate : node_.in_) {
      InLink* const link = gate.get();
      while (link != nullptr) {
        held_up_.clear();  // take() begins with the oldest one again
        if (link->take(priority, wants, buffer_, header) != TakeResult::taken) break;
        handle(header, std::span(buffer_).first(header.size));
      }
    }
  }
  return all_done;
}

// A block for a node whose queue is full stays where it is, so that its sender is the one who feels it.
bool BlockRouter::can_take(const BlockTag& tag, std::size_t priority, std::uint32_t slots) {
  if (is_gateway_for(tag.destination)) {
    return !node_.options_.remote_room || node_.options_.remote_room(tag.destination, slots);
  }
  if (tag.destination.to_all()) return true;
  const std::uint16_t hop = tag.destination.valid() ? node_.next_hop(tag.destination) : std::uint16_t{0};
  if (hop == 0 || hop > kMaxNodes || hop == node_.life_.node) return true;  // to be dropped
  if (OutLink* const link = node_.out_[hop - 1U].get()) {
    return link->broken() || link->has_room(static_cast<std::uint8_t>(priority), slots);
  }
  return true;  // connects when it is given on
}

bool BlockRouter::is_gateway_for(NodeAddress address) const noexcept {
  return node_.options_.remote && address.valid() && !node_.is_local(address);
}

void BlockRouter::handle(const BlockHeader& header, std::span<const std::byte> contents) {
  const NodeAddress to = NodeAddress::from_number(header.destination);
  if (to.to_all() && node_.is_local(to)) {
    spread(header, contents);
  } else if (is_gateway_for(to)) {
    give_to_remote(header, contents);
  } else {
    forward(header, contents);
  }
}

void BlockRouter::forward(BlockHeader header, std::span<const std::byte> contents) {
  const std::uint16_t self = node_.life_.node;
  const bool was_here = header.source == node_.address().number() || has_passed(header, self);
  if (was_here || header.hops >= node_.options_.hop_limit) {
    count_in(counters().loops);
    return;
  }
  const std::uint16_t hop = node_.next_hop(NodeAddress::from_number(header.destination));
  if (hop == 0 || hop > kMaxNodes || hop == self || !node_.options_.entry.forwards) {
    count_in(counters().no_route);
    return;
  }
  header.path[header.hops] = static_cast<std::uint8_t>(self);
  header.hops = static_cast<std::uint8_t>(header.hops + 1);
  give_to(hop, header, contents);
  count_in(counters().forwarded);
}

// For all nodes: to the tasks here, and on to those that get it from here.
void BlockRouter::spread(const BlockHeader& header, std::span<const std::byte> contents) {
  const std::uint16_t self = node_.life_.node;
  const NodeAddress source = NodeAddress::from_number(header.source);
  const bool own = header.source == node_.address().number();
  if (!filter_.first_time(header)) {
    count_in(counters().duplicates);
    return;
  }
  if (!own && node_.has_channels_.load(std::memory_order_acquire)) {
    BlockHeader copy = header;
    copy.destination = node_.address().number();
    give_to(self, copy, contents);
  }
  const std::uint16_t root = node_.is_local(source) ? source.node : header.path[0];
  if (root == 0 || root > kMaxNodes || header.hops >= node_.options_.hop_limit) return;
  BlockHeader copy = header;
  if (!own && root != self) {
    copy.path[copy.hops] = static_cast<std::uint8_t>(self);
    copy.hops = static_cast<std::uint8_t>(copy.hops + 1);
  }
  const NodeSet children = topology_.children(root, self);
  for (std::uint16_t node = 1; node <= kMaxNodes; ++node) {
    if (!children[node - 1U]) continue;
    give_to(node, copy, contents);
    if (!own) count_in(counters().forwarded);
  }
  const NodeAddress to = NodeAddress::from_number(header.destination);
  if (to.host == NodeAddress::kAllHosts && node_.options_.remote && node_.is_local(source))
    give_to_remote(header, contents);
}

void BlockRouter::give_to(std::uint16_t node, const BlockHeader& header,
                          std::span<const std::byte> contents) {
  OutLink* const link = node_.out_[node - 1U].get();
  if ((link == nullptr || link->broken()) && !connect(node)) {
    count_in(counters().no_route);
    return;
  }
  if (node_.put_to(node, header, contents) != SendResult::sent) count_in(counters().congested);
}

void BlockRouter::give_to_remote(BlockHeader header, std::span<const std::byte> contents) {
  NodeAddress source = NodeAddress::from_number(header.source);
  // Elsewhere, "this host" is another one.
  if (source.host == 0) source.host = node_.options_.host_number;
  header.source = source.number();
  switch (node_.options_.remote(header, contents)) {
    case SendResult::sent:
      count_in(counters().forwarded);
      break;
    case SendResult::congested:
    case SendResult::connecting:
      count_in(counters().congested);
      break;
    case SendResult::unreachable:
    case SendResult::invalid:
      count_in(counters().no_route);
      break;
  }
}

}  // namespace plchost
