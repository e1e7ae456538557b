#include "api/gateway/pending_blocks.hpp"

namespace plchost {

namespace {

void add_one(std::atomic<std::uint64_t>& counter) noexcept {
  counter.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace

bool PendingBlocks::put(const BlockHeader& header, std::span<const std::byte> contents) {
  switch (inject_(header, contents)) {
    case SendResult::congested:
    case SendResult::connecting:
      return false;
    case SendResult::sent:
      break;
    case SendResult::unreachable:
      add_one(counters_.no_route);
      break;
    case SendResult::invalid:
      add_one(counters_.refused);
      break;
  }
  return true;
}

void PendingBlocks::take(const BlockHeader& header, std::span<const std::byte> contents, TimePoint now) {
  const Way way{NodeAddress::from_number(header.destination).node, header.priority};
  const auto found = ways_.find(way);
  if (found == ways_.end() && put(header, contents)) return;
  const std::size_t waiting = found == ways_.end() ? 0 : found->second.size();
  if (bytes_ + contents.size() > kMostBytes || waiting >= kMostBlocks) return add_one(counters_.congested);
  ways_[way].push_back({.header = header, .contents = {contents.begin(), contents.end()}, .since = now});
  bytes_ += contents.size();
}

void PendingBlocks::retry(TimePoint now) {
  for (auto way = ways_.begin(); way != ways_.end();) {
    std::deque<Waiting>& waiting = way->second;
    while (!waiting.empty()) {
      const Waiting& first = waiting.front();
      if (!put(first.header, first.contents)) {
        if (now - first.since <= hold_) break;
        add_one(counters_.expired);
      }
      bytes_ -= first.contents.size();
      waiting.pop_front();
    }
    way = waiting.empty() ? ways_.erase(way) : std::next(way);
  }
}

NodeSet PendingBlocks::full() const noexcept {
  NodeSet full;
  for (const auto& [way, waiting] : ways_) {
    if (waiting.size() >= kFull && way.first <= kMaxNodes) full.set(way.first - 1U);
  }
  return full;
}

}  // namespace plchost
