#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "shm/block_driver/block_channel.hpp"
#include "shm/block_driver/block_router.hpp"
#include "tests/integration/api/test_host.hpp"

namespace plchost {

/// A node of the host's pool that runs by itself.
class RunningNode {
 public:
  RunningNode(const TestHost& host, const std::string& name, std::vector<std::string> neighbours = {}) {
    NodeOptions options{.pool = host.pool_name(), .entry = {.name = name}};
    options.neighbours = std::move(neighbours);
    node_ = BlockNode::join(options).value();
    router_ = BlockRouter::create(*node_).value();
    thread_ = std::thread([this] { router_->run(stop_); });
  }
  RunningNode(const RunningNode&) = delete;
  RunningNode& operator=(const RunningNode&) = delete;
  ~RunningNode() {
    stop_.store(true);
    router_->wake();
    thread_.join();
  }
  [[nodiscard]] BlockNode& node() { return *node_; }

 private:
  std::unique_ptr<BlockNode> node_;
  std::unique_ptr<BlockRouter> router_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace plchost
