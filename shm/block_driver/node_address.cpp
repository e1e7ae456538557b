#include "shm/block_driver/node_address.hpp"

#include <charconv>

#include <fmt/format.h>

namespace plchost {

namespace {

std::optional<std::uint16_t> number_in(std::string_view text) {
  std::uint16_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

}  // namespace

std::string to_string(NodeAddress address) {
  const std::string node = address.to_all() ? "all" : fmt::format("{}", address.node);
  return address.host == 0 ? node : fmt::format("{}.{}", address.host, node);
}

std::optional<NodeAddress> parse_node_address(std::string_view text) {
  NodeAddress address;
  if (const std::size_t dot = text.find('.'); dot != std::string_view::npos) {
    const auto host = number_in(text.substr(0, dot));
    if (!host) return std::nullopt;
    address.host = *host;
    text.remove_prefix(dot + 1);
  }
  if (text == "all") {
    address.node = NodeAddress::kAllNodes;
    return address;
  }
  const auto node = number_in(text);
  if (!node) return std::nullopt;
  address.node = *node;
  return !address.to_all() && address.valid() ? std::optional(address) : std::nullopt;
}

}  // namespace plchost
