#include "shm/block_driver/topology.hpp"

#include <cstddef>

namespace plchost {

void Topology::add(std::uint16_t node, const NodeSet& talks_to, bool forwards) {
  live_.set(node - 1U);
  forwards_.set(node - 1U, forwards);
  talks_to_[node - 1U] = talks_to;
}

bool Topology::neighbours(std::uint16_t a, std::uint16_t b) const noexcept {
  return a != b && has(a) && has(b) && talks_to_[a - 1U][b - 1U] && talks_to_[b - 1U][a - 1U];
}

// Breadth first, low numbers first.
Topology::Tree Topology::tree_from(std::uint16_t root) const {
  Tree tree;
  NodeSet reached;
  reached.set(root - 1U);
  std::array<std::uint16_t, kMaxNodes> queue{root};
  std::size_t queued = 1;
  for (std::size_t i = 0; i < queued; ++i) {
    const std::uint16_t node = queue[i];
    if (node != root && !forwards_[node - 1U]) continue;  // a block may end there, and goes no further
    for (std::uint16_t next = 1; next <= kMaxNodes; ++next) {
      if (reached[next - 1U] || !neighbours(node, next)) continue;
      reached.set(next - 1U);
      tree.parent[next - 1U] = node;
      tree.branch[next - 1U] = node == root ? next : tree.branch[node - 1U];
      tree.depth[next - 1U] = static_cast<std::uint8_t>(tree.depth[node - 1U] + 1);
      queue[queued++] = next;
    }
  }
  return tree;
}

std::array<std::uint16_t, kMaxNodes> Topology::next_hops(std::uint16_t from) const {
  return tree_from(from).branch;
}

std::array<std::uint8_t, kMaxNodes> Topology::distances(std::uint16_t from) const {
  return tree_from(from).depth;
}

NodeSet Topology::children(std::uint16_t root, std::uint16_t self) const {
  const Tree tree = tree_from(root);
  NodeSet children;
  for (std::size_t i = 0; i < kMaxNodes; ++i) children.set(i, tree.parent[i] == self);
  return children;
}

}  // namespace plchost
