#include "schedulers/tick/due_queue.hpp"

namespace plchost {

void DueQueue::put(Entry& entry, Duration::rep due) noexcept {
  const Node node{.due = due, .entry = &entry};
  if (entry.place_ == kNowhere) {
    nodes_.push_back(node);  // within what is reserved
    entry.place_ = nodes_.size() - 1;
  }
  settle(entry.place_, node);
}

void DueQueue::remove(Entry& entry) noexcept {
  if (entry.place_ == kNowhere) return;
  const std::size_t hole = entry.place_;
  entry.place_ = kNowhere;
  const Node last = nodes_.back();
  nodes_.pop_back();
  if (hole < nodes_.size()) settle(hole, last);
}

auto DueQueue::take_due(Duration::rep now) noexcept -> Entry* {
  if (nodes_.empty() || nodes_.front().due > now) return nullptr;
  Entry* const first = nodes_.front().entry;
  remove(*first);
  return first;
}

void DueQueue::set(std::size_t place, const Node& node) noexcept {
  nodes_[place] = node;
  node.entry->place_ = place;
}

// Puts `node` where it belongs, beginning at a `place` that is free for it.
void DueQueue::settle(std::size_t place, const Node& node) noexcept {
  for (; place > 0; place = (place - 1) / 2) {
    const Node& parent = nodes_[(place - 1) / 2];
    if (parent.due <= node.due) break;
    set(place, parent);
  }
  for (;;) {
    std::size_t child = 2 * place + 1;
    if (child + 1 < nodes_.size() && nodes_[child + 1].due < nodes_[child].due) ++child;
    if (child >= nodes_.size() || nodes_[child].due >= node.due) break;
    set(place, nodes_[child]);
    place = child;
  }
  set(place, node);
}

}  // namespace plchost
