#pragma once

#include <array>
#include <bitset>
#include <cstdint>

#include "shm/block_driver/node_address.hpp"

namespace plchost {

/// Bit N - 1 is node N.
using NodeSet = std::bitset<kMaxNodes>;

/// The connections between nodes, as the directory says. All nodes see the same one, so all of them find the
/// same ways; while it changes they may differ, which hop limit and path are for. Soft threads.
class Topology {
 public:
  /// `talks_to`: the nodes that it is willing to talk to. Two are neighbours if both are.
  void add(std::uint16_t node, const NodeSet& talks_to, bool forwards);

  [[nodiscard]] bool has(std::uint16_t node) const noexcept { return live_[node - 1U]; }
  [[nodiscard]] bool neighbours(std::uint16_t a, std::uint16_t b) const noexcept;

  /// For each node (index: number - 1) the neighbour of `from` to which a block for it is given; 0: there is
  /// no way. By the fewest links, and of equal ones by the lowest numbers.
  [[nodiscard]] std::array<std::uint16_t, kMaxNodes> next_hops(std::uint16_t from) const;
  /// The links to each node; 0: it is `from` itself, or there is no way.
  [[nodiscard]] std::array<std::uint8_t, kMaxNodes> distances(std::uint16_t from) const;
  /// The nodes to which `self` passes on a block for all nodes that comes from `root`: along one tree, so
  /// that each node gets it once.
  [[nodiscard]] NodeSet children(std::uint16_t root, std::uint16_t self) const;

 private:
  struct Tree {
    std::array<std::uint16_t, kMaxNodes> parent{};  // 0: not reached, or the root
    std::array<std::uint16_t, kMaxNodes> branch{};  // the neighbour of the root through which it is reached
    std::array<std::uint8_t, kMaxNodes> depth{};
  };
  [[nodiscard]] Tree tree_from(std::uint16_t root) const;

  NodeSet live_;
  NodeSet forwards_;
  std::array<NodeSet, kMaxNodes> talks_to_;
};

}  // namespace plchost
