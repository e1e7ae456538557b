#include <algorithm>
#include <bit>

#include <fmt/format.h>

#include "shm/block_driver/block_router.hpp"
#include "shm/block_driver/routes.hpp"
#include "shm/log/log.hpp"
#include "shm/threads/process_start.hpp"

namespace plchost {

namespace {

// In that many ticks once, what events should have told is looked for without them: strangers can wipe out
// any of their words.
constexpr std::uint32_t kTicksPerAudit = 10;

}  // namespace

void BlockRouter::tick(TimePoint now) {
  ++ticks_;
  if (node_.directory_.lost()) {
    tell({ErrorCode::corrupt, 0,
          "the directory of the nodes was cut short by another program: no other node is reached until this "
          "process "
          "is started again"});
  }
  if (const auto kept = node_.keep_record(); !kept) tell(kept.error());
  look_for_the_dead();
  if (ticks_ % kTicksPerAudit == 0) {
    refresh();
    for (std::uint16_t node = 1; node <= kMaxNodes; ++node) {
      if (topology_.neighbours(node_.life_.node, node) && node_.in_[node - 1U].closed())
        (void)open_from(node);
    }
  } else {
    drop_stale_links();
  }
  tidy(now);
}

// A lock that is free is seen in the same tick. Of a node without one a thorough look reads a file, so each
// of them has its turn.
void BlockRouter::look_for_the_dead() {
  const NodeDirectory& directory = node_.directory_;
  bool found = false;
  for (std::uint16_t node = 1; node <= kMaxNodes && !found; ++node) {
    found = lives_[node - 1U].generation != 0 && directory.has_ended(node, ProcessLook::quick);
  }
  for (std::uint32_t i = 0; i < kMaxNodes && !found; ++i) {
    suspect_ = static_cast<std::uint16_t>(suspect_ % kMaxNodes + 1);
    if (suspect_ == node_.life_.node || !directory.record(suspect_)) continue;
    found = directory.has_ended(suspect_);
    break;
  }
  if (found && node_.directory_.reclaim() > 0) refresh();
}

NodeSet BlockRouter::willing() const {
  NodeSet willing;
  const auto& names = node_.options_.neighbours;
  if (names.empty()) return willing.set();
  for (std::uint16_t node = 1; node <= kMaxNodes; ++node) {
    const auto record = node_.directory_.record(node);
    willing.set(node - 1U, record && std::ranges::find(names, record->name.view()) != names.end());
  }
  return willing;
}

void BlockRouter::refresh() {
  NodeDirectory& directory = node_.directory_;
  changes_seen_ = directory.layout().changes.load(std::memory_order_acquire);
  const NodeSet ours = willing();
  bool changed = false;
  NodeSlot& own = node_.own_slot();
  for (std::size_t word = 0; word < own.neighbours.size(); ++word) {
    std::uint64_t bits = 0;
    for (std::size_t bit = 0; bit < 64; ++bit) bits |= std::uint64_t{ours[word * 64 + bit]} << bit;
    changed = own.neighbours[word].exchange(bits, std::memory_order_acq_rel) != bits || changed;
  }
  for (std::uint16_t node = 1; node <= kMaxNodes; ++node) {
    const auto record = directory.record(node);
    lives_[node - 1U] = {.node = node, .generation = record ? record->generation : 0};
  }
  topology_ = topology_of(directory);
  publish_routes();
  drop_stale_links();
  if (changed) directory.announce();
}

void BlockRouter::publish_routes() {
  const auto hops = topology_.next_hops(node_.life_.node);
  for (std::size_t i = 0; i < hops.size(); ++i) node_.next_hops_[i].store(hops[i], std::memory_order_relaxed);
  publish_host_routes();
}

void BlockRouter::publish_host_routes() {
  const auto routes = host_routes(node_.directory_, topology_, node_.life_.node);
  for (std::size_t i = 0; i < node_.host_routes_.size(); ++i) {
    std::uint64_t word = 0;
    if (i < routes.size()) {
      const HostRange& hosts = routes[i].hosts;
      word = std::uint64_t{hosts.first} << 32 | std::uint64_t{hosts.last} << 16 | routes[i].next_hop;
    }
    node_.host_routes_[i].store(word, std::memory_order_relaxed);
  }
}

// Links to processes that ended or restarted are stale. Blocks that have come from them are still taken.
void BlockRouter::drop_stale_links() {
  for (std::uint16_t node = 1; node <= kMaxNodes; ++node) {
    const bool linked = node == node_.life_.node || topology_.neighbours(node_.life_.node, node);
    LinkGate<OutLink>& out = node_.out_[node - 1U];
    out.collect();
    if (out.get() != nullptr) {
      const bool stale = !linked || out.get()->to() != lives_[node - 1U];
      if (stale) (void)out.exchange(nullptr);
      if (!stale && out.get()->broken()) (void)connect(node);
    }
    LinkGate<InLink>& in = node_.in_[node - 1U];
    in.collect();
    if (in.get() != nullptr && in.get()->from() != lives_[node - 1U] && in.get()->empty()) {
      set_open(node, false);
      (void)in.exchange(nullptr);
    }
  }
}

void BlockRouter::set_open(std::uint16_t node, bool open) noexcept {
  const std::uint64_t bit = std::uint64_t{1} << ((node - 1U) % 64);
  std::atomic<std::uint64_t>& word = node_.open_in_[(node - 1U) / 64];
  if (open) {
    word.fetch_or(bit, std::memory_order_release);
  } else {
    word.fetch_and(~bit, std::memory_order_release);
  }
}

void BlockRouter::open_incoming() {
  for (std::size_t word = 0; word < kMaxNodes / 64; ++word) {
    std::atomic<std::uint64_t>& incoming = node_.own_slot().incoming[word];
    if (incoming.load(std::memory_order_relaxed) == 0) continue;
    for (std::uint64_t bits = incoming.exchange(0, std::memory_order_acquire); bits != 0; bits &= bits - 1) {
      const auto node =
          static_cast<std::uint16_t>(word * 64 + static_cast<unsigned>(std::countr_zero(bits)) + 1);
      // The rest of its last life is taken first; the audit comes back to it.
      if (!open_from(node)) incoming.fetch_or(bits & -bits, std::memory_order_relaxed);
    }
  }
}

// false: not yet. The last life of that node has left something, or threads are still in too many old links.
bool BlockRouter::open_from(std::uint16_t node) {
  const auto record = node_.directory_.record(node);
  if (!record) return true;
  const NodeLife life{.node = node, .generation = record->generation};
  LinkGate<InLink>& gate = node_.in_[node - 1U];
  if (gate.get() != nullptr && gate.get()->from() != life && !gate.get()->empty()) return false;
  auto memory = LinkMemory::open(node_.directory_.link(node, node_.life_.node), life, node_.life_);
  if (!memory) {
    // It is being made anew, and will be told of; or it is something else, and then people should know.
    if (memory.error().code == ErrorCode::corrupt) tell(memory.error());
    return true;
  }
  // The audit was before the sender's word. A reader begins at the first slot, so no link has two of them.
  if (gate.get() != nullptr && gate.get()->uses(*memory)) return true;
  // A fresh link in the same life replaces a broken one. The blocks in that are lost, and counted.
  if (gate.get() != nullptr) counters().expired.fetch_add(gate.get()->drop_all(), std::memory_order_relaxed);
  if (!gate.exchange(std::make_unique<InLink>(*std::move(memory), life))) return false;
  set_open(node, true);
  node_.own_slot().arrivals.post();  // blocks that came before it was open
  return true;
}

// Once, however often it happens again: tasks that send in each cycle want their link in each cycle.
void BlockRouter::tell(const Error& problem) {
  std::string text = problem.describe();
  if (text == last_problem_) return;
  spdlog::warn("{}", text);
  last_problem_ = std::move(text);
}

void BlockRouter::connect_wanted() {
  for (std::size_t word = 0; word < node_.wanted_.size(); ++word) {
    std::atomic<std::uint64_t>& wanted = node_.wanted_[word];
    if (wanted.load(std::memory_order_relaxed) == 0) continue;
    for (std::uint64_t bits = wanted.exchange(0, std::memory_order_acquire); bits != 0; bits &= bits - 1) {
      const auto node =
          static_cast<std::uint16_t>(word * 64 + static_cast<unsigned>(std::countr_zero(bits)) + 1);
      OutLink* const link = node_.out_[node - 1U].get();
      if (link != nullptr && !link->broken()) continue;
      if (auto connected = connect(node); !connected) tell(connected.error());
    }
  }
}

Result<void> BlockRouter::connect(std::uint16_t node) {
  const std::uint16_t self = node_.life_.node;
  if (node != self && !topology_.neighbours(self, node)) {
    return failure(ErrorCode::unavailable, fmt::format("node {} is no neighbour (any more)", node));
  }
  const NodeLife& to = lives_[node - 1U];
  PLCHOST_TRY_ASSIGN(auto memory, LinkMemory::make(node_.directory_.link(self, node), node_.life_, to,
                                                   node_.options_.entry.queue_slots));
  if (!node_.out_[node - 1U].exchange(std::make_unique<OutLink>(std::move(memory), to))) {
    return failure(ErrorCode::busy,
                   fmt::format("tasks of this process are still in the last links to node {}", node));
  }
  NodeSlot& slot = node_.directory_.slot(node);
  slot.incoming[(self - 1U) / 64].fetch_or(std::uint64_t{1} << ((self - 1U) % 64), std::memory_order_release);
  slot.work.post();
  return {};
}

void BlockRouter::tidy(TimePoint now) {
  bool waits = false;
  for (auto& gate : node_.in_) {
    if (gate.get() == nullptr) continue;
    counters().expired.fetch_add(gate.get()->tidy(now, node_.options_.hold), std::memory_order_relaxed);
    waits = waits || gate.get()->waits();
  }
  // Its sender may have ended between the block and its post.
  if (waits) node_.own_slot().arrivals.post();
}

}  // namespace plchost
