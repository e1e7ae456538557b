#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "instances/plc_app.h"
#include "instances/runtime/settings/settings.hpp"
#include "shm/base/result.hpp"
#include "shm/block_driver/block_channel.hpp"
#include "shm/block_driver/block_router.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

/// The instance as a node of its pool: from the start if the settings say so, else from the first channel on.
/// With a soft thread for its router. Set-up: control thread.
class BlockService {
 public:
  /// Without a pool (empty) it only gives out handles: for checking an application that shall touch nothing.
  BlockService(std::string pool, std::string instance)
      : pool_(std::move(pool)), instance_(std::move(instance)) {}
  ~BlockService();
  BlockService(const BlockService&) = delete;
  BlockService& operator=(const BlockService&) = delete;

  /// Whether another process has the address that the settings force, as far as that can be told without
  /// joining. busy: it has. Set-up.
  [[nodiscard]] static Result<void> check(const std::string& pool, const std::string& instance,
                                          const BlockSettings& settings);
  /// Before the first channel. Joins if the settings want it. busy: another process has the forced address.
  [[nodiscard]] Result<void> configure(const BlockSettings& settings);

  /// The handle of the channel of that name; one name, one handle. invalid_argument; full.
  [[nodiscard]] Result<RTS_HANDLE> open_channel(std::string_view name);
  /// As EventTable does it with events. A place among the nodes is not given back: tasks may use it.
  void open_for_version(bool on) noexcept { for_version_ = on; }
  void keep_opened() noexcept;
  void give_back_opened() noexcept;

  /// Null: not such a handle, or there is no node behind it. Real-time.
  [[nodiscard]] BlockChannel* channel(RTS_HANDLE handle) noexcept;
  /// Null: the instance is no node. Real-time.
  [[nodiscard]] BlockNode* node() noexcept { return node_now_.load(std::memory_order_acquire); }

 private:
  struct Channel {
    std::string name;         // empty: given back
    bool of_version = false;  // opened by a version beside the application that runs, and by nobody else
    std::atomic<BlockChannel*> open{nullptr};             // the last one; null: given back, or no node
    std::vector<std::unique_ptr<BlockChannel>> channels;  // old ones stay: a task may be in one
  };
  [[nodiscard]] Result<void> join();

  std::string pool_;
  std::string instance_;
  BlockSettings settings_;
  std::unique_ptr<BlockNode> node_;
  std::atomic<BlockNode*> node_now_{nullptr};
  std::unique_ptr<BlockRouter> router_;
  std::array<Channel, PLC_MAX_CHANNELS> channels_;
  std::atomic<std::size_t> channel_count_{0};
  bool for_version_ = false;
  std::atomic<bool> stop_{false};
  Thread thread_;  // of the router
};

}  // namespace plchost
