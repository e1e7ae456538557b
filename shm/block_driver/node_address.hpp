#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace plchost {

/// Nodes of one pool: instances, firmware and the gateway to other hosts.
inline constexpr std::uint32_t kMaxNodes = 128;

/// Hosts have numbers from 1 to this one, for each other.
inline constexpr std::uint16_t kMaxHostNumber = 0xfffe;

/// The receiver or sender of a block: an instance on this or another host.
struct NodeAddress {
  /// As a node number: every node of the host.
  static constexpr std::uint16_t kAllNodes = 0xffff;
  /// As a host number, with kAllNodes: every node of every host.
  static constexpr std::uint16_t kAllHosts = 0xffff;

  std::uint16_t host = 0;  ///< 0: this host
  std::uint16_t node = 0;  ///< 1 to kMaxNodes, or kAllNodes; 0: no node

  [[nodiscard]] constexpr bool to_all() const noexcept { return node == kAllNodes; }
  /// Whether it can name a node (or all of them).
  [[nodiscard]] constexpr bool valid() const noexcept {
    return to_all() || (node >= 1 && node <= kMaxNodes && host != kAllHosts);
  }

  /// For C interfaces and messages: the host in the upper half.
  [[nodiscard]] constexpr std::uint32_t number() const noexcept { return std::uint32_t{host} << 16 | node; }
  [[nodiscard]] static constexpr NodeAddress from_number(std::uint32_t number) noexcept {
    return {.host = static_cast<std::uint16_t>(number >> 16), .node = static_cast<std::uint16_t>(number)};
  }
  bool operator==(const NodeAddress&) const = default;
};

/// "17" on this host, "3.17" on host 3, "all", "3.all", "65535.all" on all hosts. Set-up.
[[nodiscard]] std::string to_string(NodeAddress address);
/// Reads the text of to_string(); nothing: it is no address. Set-up.
[[nodiscard]] std::optional<NodeAddress> parse_node_address(std::string_view text);

}  // namespace plchost
