// How the Manager takes over its configuration file again, and instances that this does not have any more.

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "instances/launch/launch_contract.hpp"
#include "manager/config/config_changes.hpp"
#include "manager/manager.hpp"
#include "manager/pool_rights.hpp"
#include "manager/store/wish_memory.hpp"
#include "manager/supervisor/instance_files.hpp"
#include "shm/log/log.hpp"
#include "shm/pages/debug_page.hpp"
#include "shm/pages/flight_page.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/pages/log_ring.hpp"
#include "shm/pages/outputs_page.hpp"
#include "shm/threads/thread.hpp"
#include "shm/variables/symbol_page.hpp"

namespace plchost {

namespace {

constexpr Duration kConfigReadLimit = std::chrono::seconds(2);

}  // namespace

// Their processes run on: an edited file ends no machine.
void Manager::adopt_removed() {
  for (const std::string& name : WishMemory::instances(config_.host.pool)) {
    const bool configured =
        std::ranges::find(config_.instances, name, &InstanceConfig::name) != config_.instances.end();
    if (configured) continue;
    if (auto ring = open_transitions(name)) transitions_.emplace(name, *std::move(ring));
    if (supervisor_->adopt_removed(name)) {
      spdlog::warn("instance {}: runs and is not in the configuration any more; it runs until it is stopped",
                   name);
    } else {
      end_outputs_of(config_.host.pool, name);
      pool_->withdraw_events(name);
      wishes_.erase(name);
      transitions_.erase(name);
      remove_kept_settings(name);
    }
  }
}

Result<std::vector<std::string>> Manager::reload() {
  PLCHOST_TRY_ASSIGN(auto read, config_disk_.ask<std::expected<ManagerConfig, ConfigErrors>>(
                                    kConfigReadLimit, options_.file, options_.read));
  if (!read) {  // changed since it was checked
    return failure(ErrorCode::invalid_argument, join_lines(read.error(), "plchostd --check-config"));
  }
  ManagerConfig& now = *read;
  PLCHOST_TRY(supervisor_->check_room(now.instances));
  for (const InstanceConfig& instance : now.instances) {
    if (transitions_.contains(instance.name)) continue;
    PLCHOST_TRY_ASSIGN(auto ring,
                       in_step(fmt::format("instance '{}'", instance.name), open_transitions(instance.name)));
    transitions_.emplace(instance.name, std::move(ring));
  }
  std::vector<std::string> lines;
  take_over_host(now, lines);
  config_.instances = std::move(now.instances);
  std::ranges::move(supervisor_->reload(config_.instances), std::back_inserter(lines));
  return lines;
}

// One line for each key that is another one, or waits since an earlier reload.
void Manager::take_over_host(const ManagerConfig& now, std::vector<std::string>& lines) {
  const bool served = config_.dds.enabled;
  const auto changes = changed_keys(config_, now);
  for (const KeyChange& change : changes) {
    std::string_view effect = describe(change.when);
    if (change.when == TakesEffect::new_server && !now.dds.enabled) {
      effect = served ? "used at once; plchost-dds ends" : describe(TakesEffect::at_once);
    }
    lines.push_back(change_text(change.key, effect, change.why));
  }
  plchost::take_over(config_, now);
  spdlog::set_level(spdlog::level::from_str(config_.host.log_level));
  supervisor_->use_log_level();
  const auto has_changed = [&](std::string_view key) {
    return std::ranges::any_of(changes, [&](const KeyChange& change) { return change.key.starts_with(key); });
  };
  if (has_changed("[host] housekeeping_cores")) use_housekeeping_cores(lines);
  if (has_changed("[host] pool_")) use_pool_rights(lines);
  if (has_changed("[host] allow_debug")) {
    std::ranges::move(supervisor_->tell_debug_builds(), std::back_inserter(lines));
  }
  const bool served_anew =
      std::ranges::find(changes, TakesEffect::new_server, &KeyChange::when) != changes.end();
  if (has_changed("[dds] ")) share_with_server();
  if (served_anew) api_server_.renew();
}

void Manager::use_housekeeping_cores(std::vector<std::string>& lines) const {
  constexpr int kSelf = 0;
  for (const std::optional<int> process :
       {std::optional(kSelf), api_server_.process(), wish_writer_.process()}) {
    if (!process) continue;
    const auto bound = bind_process_to_cores(*process, config_.host.housekeeping_cores);
    if (!bound) lines.push_back(failure_in("[host] housekeeping_cores", bound.error()).error().describe());
  }
}

void Manager::use_pool_rights(std::vector<std::string>& lines) const {
  const auto renewed = and_then(pool_rights(config_.host), [&](const auto& rights) {
    return renew_pool_rights(config_.host.pool, rights);
  });
  if (!renewed) lines.push_back(renewed.error().describe());
}

// Values that it has kept in memory and not written to a file stay for the end of this manager.
void Manager::gone(std::size_t place, const InstanceConfig& instance) {
  spdlog::info("instance {}: was removed from the configuration and has ended", instance.name);
  if (const auto wishes = wishes_.extract(instance.name)) wishes.mapped()->end();
  transitions_.erase(instance.name);
  remove_pages(instance.name);
  remove_kept_settings(instance.name);
  std::erase_if(gone_, [&](const InstanceConfig& known) { return known.name == instance.name; });
  gone_.push_back(instance);
  // Last: when nobody sees it any more, nothing of it is left.
  page_->write_instance(static_cast<std::uint32_t>(place), {});
}

// They are those of its last process, which no other one follows.
void Manager::remove_kept_settings(const std::string& instance) const {
  ::unlink(kept_settings_path(config_.host.run_directory, instance).c_str());
}

void Manager::remove_pages(const std::string& instance) const {
  InstancePage::remove(config_.host.pool, instance);
  SymbolPage::remove(config_.host.pool, instance);
  TransitionRing::remove(config_.host.pool, instance);
  LogRing::remove(config_.host.pool, instance);
  OutputsPage::remove(config_.host.pool, instance);
  DebugPage::remove(config_.host.pool, instance);
  FlightPage::remove(config_.host.pool, instance);
}

}  // namespace plchost
