#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <unistd.h>

#include "tests/integration/api/running_node.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {

/// A host with a number, and one node on it.
struct Side {
  TestHost host;
  RunningNode node;
  BlockChannel channel;
  std::vector<std::byte> buffer = std::vector<std::byte>(kMaxBlockSize);
  Received received;

  /// `more`: arguments of its server.
  Side(const OwnDomain& domain, const std::string& name, int number, const std::string& node_name,
       const std::vector<std::string>& more = {})
      : host(domain, name),
        node(start(host, number, more), node_name),
        channel(BlockChannel::open(node.node(), "test").value()) {}
  ~Side() { NodeDirectory::remove(host.pool_name()); }
  Side(const Side&) = delete;
  Side& operator=(const Side&) = delete;

  static TestHost& start(TestHost& host, int number, const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"--host-number", std::to_string(number), "--peer", "127.0.0.1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    host.start_server(std::move(arguments));
    return host;
  }
  [[nodiscard]] NodeAddress address_at(std::uint16_t number) {
    return {.host = number, .node = node.node().address().node};
  }
  /// The next block; nothing if none comes.
  [[nodiscard]] std::optional<std::vector<std::byte>> next(Duration patience = kPatience) {
    for (const TimePoint end = MonotonicClock::now() + patience;; ::usleep(200)) {
      if (channel.receive(buffer, received) == TakeResult::taken) {
        return std::vector(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(received.size));
      }
      if (MonotonicClock::now() >= end) return std::nullopt;
    }
  }
};

}  // namespace plchost
