// How the Manager takes over its configuration file again, and instances that this does not have any more.

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "manager/config/config_changes.hpp"
#include "manager/manager.hpp"
#include "manager/store/wish_memory.hpp"
#include "shm/base/log.hpp"
#include "shm/pool/instance_page.hpp"
#include "shm/pool/log_ring.hpp"

namespace plchost {

// Their processes run on: an edited file ends no machine.
void Manager::adopt_removed() {
  for (const std::string& name : WishMemory::instances(config_.host.pool)) {
    const bool configured =
        std::ranges::find(config_.instances, name, &InstanceConfig::name) != config_.instances.end();
    if (configured) continue;
    if (auto ring = TransitionRing::open(config_.host.pool, name))
      transitions_.emplace(name, *std::move(ring));
    if (supervisor_->adopt_removed(name)) {
      spdlog::warn("instance {}: runs and is not in the configuration any more; it runs until it is stopped",
                   name);
    } else {
      wishes_.erase(name);
      transitions_.erase(name);
    }
  }
}

Result<std::vector<std::string>> Manager::reload() {
  auto read = options_.read();
  if (!read) {  // changed since it was checked
    return failure(ErrorCode::invalid_argument, join_lines(read.error(), "plchostd --check-config"));
  }
  ManagerConfig& now = *read;
  if (auto room = supervisor_->check_room(now.instances); !room) return std::unexpected(room.error());
  for (const InstanceConfig& instance : now.instances) {
    if (transitions_.contains(instance.name)) continue;
    auto ring = TransitionRing::open(config_.host.pool, instance.name);
    if (!ring) return failure_in(fmt::format("instance '{}'", instance.name), ring.error());
    transitions_.emplace(instance.name, *std::move(ring));
  }
  std::vector<std::string> lines;
  for (const KeyChange& change : changed_keys(config_, now)) {
    const bool live = change.when == TakesEffect::at_once;
    lines.push_back(
        fmt::format("{} changed{}", change.key, live ? "" : ", used when plchostd starts the next time"));
  }
  config_.host.cores = now.host.cores;
  config_.host.log_level = now.host.log_level;
  config_.host.keep_pool = now.host.keep_pool;
  spdlog::set_level(spdlog::level::from_str(config_.host.log_level));
  config_.instances = std::move(now.instances);
  std::ranges::move(supervisor_->reload(config_.instances), std::back_inserter(lines));
  return lines;
}

// Values that it has kept in memory and not written to a file stay for the end of this manager.
void Manager::forget(std::size_t place, const InstanceConfig& instance) {
  spdlog::info("instance {}: was removed from the configuration and has ended", instance.name);
  page_->write_instance(static_cast<std::uint32_t>(place), {});
  if (const auto wishes = wishes_.extract(instance.name)) wishes.mapped()->end();
  transitions_.erase(instance.name);
  remove_pages(instance.name);
  std::erase_if(gone_, [&](const InstanceConfig& known) { return known.name == instance.name; });
  gone_.push_back(instance);
}

void Manager::remove_pages(const std::string& instance) const {
  InstancePage::remove(config_.host.pool, instance);
  TransitionRing::remove(config_.host.pool, instance);
  LogRing::remove(config_.host.pool, instance);
}

}  // namespace plchost
