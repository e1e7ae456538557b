#include "instances/runtime/blocks/block_service.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "shm/block_driver/node_directory.hpp"
#include "shm/log/log.hpp"

namespace plchost {

BlockService::~BlockService() {
  stop_.store(true, std::memory_order_release);
  if (thread_.joinable()) router_->wake();
  thread_.join();
}

Result<void> BlockService::check(const std::string& pool, const std::string& instance,
                                 const BlockSettings& settings) {
  if (settings.forced_address == 0 || settings.forced_address > kMaxNodes) return {};
  const auto directory = NodeDirectory::open_to_read(pool, settings.base);
  if (!directory) return {};  // no node has joined yet
  const auto owner = directory->record(settings.forced_address);
  if (!owner || owner->name.view() == instance || directory->has_ended(settings.forced_address)) return {};
  return failure(
      ErrorCode::busy,
      fmt::format("[CmpBlkDrvShm]: node address {} is taken: node '{}', {}, has it", settings.forced_address,
                  owner->name.view(), directory->owner_text(settings.forced_address)));
}

Result<void> BlockService::configure(const BlockSettings& settings) {
  settings_ = settings;
  // A node that forces an address wants to be found there.
  return settings_.enable || settings_.forced_address != 0 ? join() : Result<void>{};
}

Result<void> BlockService::join() {
  if (node_ || pool_.empty()) return {};
  const NodeOptions options{.pool = pool_,
                            .base = settings_.base,
                            .entry = {.name = instance_,
                                      .forced_address = settings_.forced_address,
                                      .forwards = settings_.forward,
                                      .queue_slots = settings_.queue_slots},
                            .neighbours = settings_.neighbours,
                            .hop_limit = settings_.hop_limit,
                            .hold = settings_.hold};
  auto node = BlockNode::join(options);
  if (!node) {
    // To the manager already_exists is the instance's own name, for which it waits.
    Error error = std::move(node).error();
    if (error.code == ErrorCode::already_exists) error.code = ErrorCode::busy;
    return failure_in("[CmpBlkDrvShm]", std::move(error));
  }
  PLCHOST_TRY_ASSIGN(auto router, in_step("[CmpBlkDrvShm]", BlockRouter::create(**node)));
  PLCHOST_TRY_ASSIGN(auto thread,
                     in_step("[CmpBlkDrvShm]",
                             Thread::start("blocks", {}, [this, run = router.get()] { run->run(stop_); })));
  node_ = *std::move(node);
  router_ = std::move(router);
  thread_ = std::move(thread);
  node_now_.store(node_.get(), std::memory_order_release);
  spdlog::info("node '{}' with address {}", instance_, to_string(node_->address()));
  return {};
}

Result<RTS_HANDLE> BlockService::open_channel(std::string_view name) {
  const std::size_t count = channel_count_.load(std::memory_order_relaxed);
  std::size_t free = count;
  for (std::size_t i = 0; i < count; ++i) {
    Channel& known = channels_[i];
    if (known.name.empty() && free == count) free = i;
    if (known.name != name || name.empty()) continue;
    known.of_version = known.of_version && for_version_;
    return &known;
  }
  PLCHOST_TRY(check_channel_name(name));
  if (free == channels_.size()) {
    return failure(ErrorCode::full, fmt::format("more than {} channels", channels_.size()));
  }
  PLCHOST_TRY(join());
  Channel& place = channels_[free];
  if (node_) {
    PLCHOST_TRY_ASSIGN(auto channel, BlockChannel::open(*node_, name));
    place.channels.push_back(std::make_unique<BlockChannel>(std::move(channel)));
    place.open.store(place.channels.back().get(), std::memory_order_release);
  }
  place.name = name;
  place.of_version = for_version_;
  channel_count_.store(std::max(count, free + 1), std::memory_order_release);
  return &place;
}

void BlockService::keep_opened() noexcept {
  for (Channel& channel : channels_) channel.of_version = false;
}

void BlockService::give_back_opened() noexcept {
  for (Channel& channel : channels_) {
    if (!std::exchange(channel.of_version, false)) continue;
    if (BlockChannel* const open = channel.open.exchange(nullptr)) open->close();
    channel.name.clear();
  }
}

BlockChannel* BlockService::channel(RTS_HANDLE handle) noexcept {
  const auto* const place = static_cast<const Channel*>(handle);
  const std::size_t count = channel_count_.load(std::memory_order_acquire);
  // Any bits may come in as a handle: compared as numbers, and used only if they are one of ours.
  const auto offset =
      reinterpret_cast<std::uintptr_t>(place) - reinterpret_cast<std::uintptr_t>(&channels_[0]);
  const std::size_t index = offset / sizeof(Channel);
  if (index >= count || offset % sizeof(Channel) != 0) return nullptr;
  return channels_[index].open.load(std::memory_order_acquire);
}

}  // namespace plchost
