#include "manager/config/config_changes.hpp"

#include <utility>

namespace plchost {

namespace {

// Collects the keys whose values differ.
class KeyChanges {
 public:
  explicit KeyChanges(std::string section) : section_(std::move(section)) {}

  template <class Value>
  void compare(const char* key, TakesEffect when, const Value& before, const Value& now) {
    if (!(before == now)) all_.push_back({.key = section_ + key, .when = when});
  }
  [[nodiscard]] std::vector<KeyChange> take() { return std::move(all_); }

 private:
  std::string section_;
  std::vector<KeyChange> all_;
};

// In each function the binding names all members, so that a new one does not compile without its row.

std::vector<KeyChange> changed_host(const HostConfig& before, const HostConfig& now) {
  const auto& [name, labels, domain, run_directory, state_directory, limit, versions, pool, objects, owner,
               group, mode, cores, housekeeping, log_level, keep_pool] = before;
  KeyChanges changes("[host] ");
  changes.compare("name", TakesEffect::next_manager, name, now.name);
  changes.compare("labels", TakesEffect::next_manager, labels, now.labels);
  changes.compare("dds_domain", TakesEffect::next_manager, domain, now.dds_domain);
  changes.compare("run_directory", TakesEffect::next_manager, run_directory, now.run_directory);
  changes.compare("state_directory", TakesEffect::next_manager, state_directory, now.state_directory);
  changes.compare("application_limit_mib", TakesEffect::next_manager, limit, now.application_limit_mib);
  changes.compare("application_versions", TakesEffect::next_manager, versions, now.application_versions);
  changes.compare("pool", TakesEffect::next_manager, pool, now.pool);
  changes.compare("pool_objects", TakesEffect::next_manager, objects, now.pool_objects);
  changes.compare("pool_owner", TakesEffect::next_manager, owner, now.pool_owner);
  changes.compare("pool_group", TakesEffect::next_manager, group, now.pool_group);
  changes.compare("pool_mode", TakesEffect::next_manager, mode, now.pool_mode);
  changes.compare("cores", TakesEffect::at_once, cores, now.cores);
  changes.compare("housekeeping_cores", TakesEffect::next_manager, housekeeping, now.housekeeping_cores);
  changes.compare("log_level", TakesEffect::at_once, log_level, now.log_level);
  changes.compare("keep_pool", TakesEffect::at_once, keep_pool, now.keep_pool);
  return changes.take();
}

std::vector<KeyChange> changed_dds(const DdsConfig& before, const DdsConfig& now) {
  const auto& [enabled, interface, peers, multicast, identity, allow_unsecured] = before;
  KeyChanges changes("[dds] ");
  changes.compare("enabled", TakesEffect::next_manager, enabled, now.enabled);
  changes.compare("interface", TakesEffect::next_manager, interface, now.interface);
  changes.compare("peers", TakesEffect::next_manager, peers, now.peers);
  changes.compare("multicast", TakesEffect::next_manager, multicast, now.multicast);
  changes.compare("identity", TakesEffect::next_manager, identity, now.identity);
  changes.compare("allow_unsecured", TakesEffect::next_manager, allow_unsecured, now.allow_unsecured);
  return changes.take();
}

std::vector<KeyChange> changed_blocks(const BlocksConfig& before, const BlocksConfig& now) {
  const auto& [host_number, base] = before;
  KeyChanges changes("[blocks] ");
  changes.compare("host_number", TakesEffect::next_manager, host_number, now.host_number);
  changes.compare("base", TakesEffect::next_manager, base, now.base);
  return changes.take();
}

}  // namespace

std::vector<KeyChange> changed_keys(const ManagerConfig& before, const ManagerConfig& now) {
  const auto& [host, dds, blocks, instances] = before;
  std::vector<KeyChange> all;
  for (auto&& part :
       {changed_host(host, now.host), changed_dds(dds, now.dds), changed_blocks(blocks, now.blocks)}) {
    all.insert(all.end(), part.begin(), part.end());
  }
  return all;
}

std::vector<KeyChange> changed_keys(const InstanceConfig& before, const InstanceConfig& now) {
  const auto& [name, core, share_core, scheduler, band, settings, application, autostart, after, restart,
               delay, delay_max, crash_limit, crash_window] = before;
  KeyChanges changes("");
  changes.compare("name", TakesEffect::at_once, name, now.name);
  changes.compare("core", TakesEffect::next_process, core, now.core);
  changes.compare("share_core", TakesEffect::at_once, share_core, now.share_core);
  changes.compare("scheduler", TakesEffect::next_process, scheduler, now.scheduler);
  changes.compare("priority_band", TakesEffect::next_process, band, now.priority_band);
  changes.compare("settings", TakesEffect::next_process, settings, now.settings);
  changes.compare("application", TakesEffect::next_process, application, now.application);
  changes.compare("autostart", TakesEffect::next_manager, autostart, now.autostart);
  changes.compare("after", TakesEffect::at_once, after, now.after);
  changes.compare("restart", TakesEffect::at_once, restart, now.restart);
  changes.compare("restart_delay_ms", TakesEffect::at_once, delay, now.restart_delay);
  changes.compare("restart_delay_max_ms", TakesEffect::at_once, delay_max, now.restart_delay_max);
  changes.compare("crash_limit", TakesEffect::at_once, crash_limit, now.crash_limit);
  changes.compare("crash_window_s", TakesEffect::at_once, crash_window, now.crash_window);
  return changes.take();
}

}  // namespace plchost
