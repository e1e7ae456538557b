#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
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

/// Sends blocks until the last one has come, so that none is under way afterwards. A block is lost if it is
/// sent before both hosts know of each other. The same happens if the machine keeps a server from the
/// processor for longer than its lease. false: none has come.
[[nodiscard]] inline bool reach(Side& from, NodeAddress to, Side& at) {
  Duration patience = std::chrono::milliseconds(50);
  const TimePoint end = MonotonicClock::now() + kPatience;
  for (std::uint32_t number = 1; MonotonicClock::now() < end; ++number, patience *= 2) {
    (void)from.channel.send(to, std::as_bytes(std::span(&number, 1)));
    const TimePoint again = MonotonicClock::now() + patience;
    for (std::uint32_t come = 0; MonotonicClock::now() < again;) {
      const auto block = at.next(again - MonotonicClock::now());
      if (block && block->size() == sizeof come) std::memcpy(&come, block->data(), sizeof come);
      if (come == number) return true;
    }
  }
  return false;
}

}  // namespace plchost
