#pragma once

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "shm/block_driver/block_channel.hpp"
#include "shm/block_driver/block_node.hpp"
#include "shm/block_driver/block_router.hpp"
#include "tests/unit/pool/unique_pool_name.hpp"

namespace plchost {

inline std::vector<std::byte> bytes_of(std::string_view text) {
  std::vector<std::byte> bytes(text.size());
  std::ranges::transform(text, bytes.begin(), [](char c) { return static_cast<std::byte>(c); });
  return bytes;
}

/// A node with its router, which runs only when the test says so.
struct TestNode {
  std::unique_ptr<BlockNode> node;
  std::unique_ptr<BlockRouter> router;
  std::vector<std::byte> buffer = std::vector<std::byte>(kMaxBlockSize);
  Received received = {};

  [[nodiscard]] NodeAddress address() const { return node->address(); }
  [[nodiscard]] BlockChannel channel(std::string_view name = "test") const {
    return BlockChannel::open(*node, name).value();
  }
  /// The next block on that channel; "nothing" if none comes.
  std::string next(BlockChannel& channel) {
    if (channel.receive(buffer, received) != TakeResult::taken) return "nothing";
    std::string text(received.size, '\0');
    std::transform(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(received.size), text.begin(),
                   [](std::byte byte) { return static_cast<char>(byte); });
    return text;
  }
};

/// Nodes of one pool in one process; time is the test's.
class BlockNodes : public testing::Test {
 protected:
  ~BlockNodes() override { NodeDirectory::remove(pool()); }

  [[nodiscard]] const std::string& pool() const { return pool_.get(); }
  [[nodiscard]] NodeOptions options(const std::string& name) const {
    NodeOptions options{.pool = pool(), .entry = {.name = name}};
    options.entry.queue_slots = kMinRingSlots;
    return options;
  }
  TestNode join(const NodeOptions& options) {
    auto node = BlockNode::join(options);
    EXPECT_TRUE(node) << node.error().describe();
    auto router = BlockRouter::create(**node);
    EXPECT_TRUE(router) << router.error().describe();
    return {.node = *std::move(node), .router = *std::move(router)};
  }
  TestNode join(const std::string& name, std::vector<std::string> neighbours = {}) {
    NodeOptions chosen = options(name);
    chosen.neighbours = std::move(neighbours);
    return join(chosen);
  }
  /// Lets all routers work until nothing changes any more.
  template <class... Nodes>
  void settle(Nodes&... nodes) {
    for (int turn = 0; turn < 6; ++turn) (nodes.router->serve(now_), ...);
  }
  template <class... Nodes>
  void pass(Duration time, Nodes&... nodes) {
    for (const TimePoint end = now_ + time; now_ < end; now_ += std::chrono::milliseconds(50))
      settle(nodes...);
  }
  /// Makes the link, so that the next send finds it.
  template <class... Others>
  void connect(TestNode& from, TestNode& to, Others&... between) {
    settle(from, between..., to);
    BlockChannel channel = from.channel("connect");
    EXPECT_EQ(channel.send(to.address(), {}), SendResult::connecting);
    settle(from, between..., to);
  }
  [[nodiscard]] NodeCounters& counters(const TestNode& node) {
    if (!directory_) directory_.emplace(NodeDirectory::open(pool()).value());
    return directory_->slot(node.address().node).counters;
  }

  UniquePoolName pool_;
  TimePoint now_ = TimePoint(std::chrono::hours(1));
  std::optional<NodeDirectory> directory_;
};

}  // namespace plchost
