#include "manager/config/config_changes.hpp"

#include <array>
#include <cstddef>

#include <fmt/format.h>

namespace plchost {

namespace {

// Stands for any member of an aggregate, to count them.
struct AnyMember {
  template <class Member>
  operator Member() const;  // NOLINT: implicit on purpose, and never defined
};

template <class Config, class... Members>
consteval std::size_t count_members() {
  if constexpr (requires { Config{Members{}..., AnyMember{}}; }) {
    return count_members<Config, Members..., AnyMember>();
  } else {
    return sizeof...(Members);
  }
}

template <class Config>
struct Row {
  ConfigKey key;
  bool (*differs)(const Config&, const Config&);
  void (*take)(Config&, const Config&);
};

template <auto Member>
struct Access;

template <class Config, class Value, Value Config::* Member>
struct Access<Member> {
  static bool differs(const Config& before, const Config& now) { return !(before.*Member == now.*Member); }
  static void take(Config& used, const Config& now) { used.*Member = now.*Member; }
  static constexpr Row<Config> row(std::string_view section, std::string_view name, TakesEffect when,
                                   std::string_view why) {
    return {.key = {.section = section, .name = name, .when = when, .why = why},
            .differs = &Access::differs,
            .take = &Access::take};
  }
};

template <auto Member>
constexpr auto host(std::string_view name, TakesEffect when, std::string_view why = {}) {
  return Access<Member>::row("[host]", name, when, why);
}
template <auto Member>
constexpr auto dds(std::string_view name) {
  return Access<Member>::row("[dds]", name, TakesEffect::new_server, {});
}
template <auto Member>
constexpr auto blocks(std::string_view name) {
  return Access<Member>::row("[blocks]", name, TakesEffect::new_server, {});
}
template <auto Member>
constexpr auto instance(std::string_view name, TakesEffect when) {
  return Access<Member>::row("[[instance]]", name, when, {});
}

using enum TakesEffect;

constexpr std::string_view kOfNewObjects = "by the pool and by new objects; the others keep their rights";
constexpr std::array kHostRows = {
    host<&HostConfig::name>("name", next_manager, "folders of the host have this name"),
    host<&HostConfig::labels>("labels", new_server),
    host<&HostConfig::dds_domain>("dds_domain", new_server),
    host<&HostConfig::run_directory>("run_directory", next_manager, "the sockets of its instances are there"),
    host<&HostConfig::state_directory>("state_directory", next_manager,
                                       "its instances keep their files there"),
    host<&HostConfig::application_limit_mib>("application_limit_mib", new_server),
    host<&HostConfig::application_versions>("application_versions", at_once),
    host<&HostConfig::pool>("pool", next_manager, "its instances use that pool"),
    host<&HostConfig::pool_objects>("pool_objects", next_manager, "its instances have the pool mapped"),
    host<&HostConfig::pool_owner>("pool_owner", at_once, kOfNewObjects),
    host<&HostConfig::pool_group>("pool_group", at_once, kOfNewObjects),
    host<&HostConfig::pool_mode>("pool_mode", at_once, kOfNewObjects),
    host<&HostConfig::cores>("cores", at_once),
    host<&HostConfig::housekeeping_cores>("housekeeping_cores", at_once),
    host<&HostConfig::log_level>("log_level", new_server),
    host<&HostConfig::keep_pool>("keep_pool", at_once),
};
constexpr std::array kDdsRows = {
    dds<&DdsConfig::enabled>("enabled"),   dds<&DdsConfig::interface>("interface"),
    dds<&DdsConfig::peers>("peers"),       dds<&DdsConfig::multicast>("multicast"),
    dds<&DdsConfig::identity>("identity"), dds<&DdsConfig::allow_unsecured>("allow_unsecured"),
};
constexpr std::array kBlocksRows = {
    blocks<&BlocksConfig::host_number>("host_number"),
    blocks<&BlocksConfig::base>("base"),
};
constexpr std::array kInstanceRows = {
    instance<&InstanceConfig::name>("name", at_once),  // another name is another instance
    instance<&InstanceConfig::core>("core", next_process),
    instance<&InstanceConfig::share_core>("share_core", at_once),
    instance<&InstanceConfig::scheduler>("scheduler", next_process),
    instance<&InstanceConfig::priority_band>("priority_band", next_process),
    instance<&InstanceConfig::settings>("settings", next_process),
    instance<&InstanceConfig::application>("application", next_process),
    instance<&InstanceConfig::autostart>("autostart", next_start),
    instance<&InstanceConfig::after>("after", at_once),
    instance<&InstanceConfig::restart>("restart", at_once),
    instance<&InstanceConfig::restart_delay>("restart_delay_ms", at_once),
    instance<&InstanceConfig::restart_delay_max>("restart_delay_max_ms", at_once),
    instance<&InstanceConfig::crash_limit>("crash_limit", at_once),
    instance<&InstanceConfig::crash_window>("crash_window_s", at_once),
};
static_assert(kHostRows.size() == count_members<HostConfig>(), "each key of [host] has its row");
static_assert(kDdsRows.size() == count_members<DdsConfig>(), "each key of [dds] has its row");
static_assert(kBlocksRows.size() == count_members<BlocksConfig>(), "each key of [blocks] has its row");
static_assert(kInstanceRows.size() == count_members<InstanceConfig>(),
              "each key of [[instance]] has its row");

constexpr auto kAllKeys = [] {
  std::array<ConfigKey, kHostRows.size() + kDdsRows.size() + kBlocksRows.size() + kInstanceRows.size()> all;
  std::size_t at = 0;
  for (const auto& row : kHostRows) all[at++] = row.key;
  for (const auto& row : kDdsRows) all[at++] = row.key;
  for (const auto& row : kBlocksRows) all[at++] = row.key;
  for (const auto& row : kInstanceRows) all[at++] = row.key;
  return all;
}();

template <class Rows, class Config>
void compare(const Rows& rows, const Config& before, const Config& now, bool with_section,
             std::vector<KeyChange>& changes) {
  for (const auto& row : rows) {
    if (!row.differs(before, now)) continue;
    const std::string section = with_section ? fmt::format("{} ", row.key.section) : "";
    changes.push_back(
        {.key = fmt::format("{}{}", section, row.key.name), .when = row.key.when, .why = row.key.why});
  }
}

template <class Rows, class Config>
void take_rows(const Rows& rows, Config& used, const Config& now) {
  for (const auto& row : rows) {
    if (row.key.when == at_once || row.key.when == new_server) row.take(used, now);
  }
}

}  // namespace

std::span<const ConfigKey> all_config_keys() noexcept {
  return kAllKeys;
}

std::string_view describe(TakesEffect when) noexcept {
  switch (when) {
    case at_once:
      return "used at once";
    case new_server:
      return "used at once; plchost-dds is restarted for it, and the PLCs run on";
    case next_process:
      return "used from the next start or restart of the instance";
    case next_start:
      return "used when the host starts the next time; until then start and stop decide";
    case next_manager:
      return "used when plchostd is restarted, which ends the instances";
  }
  return "";
}

std::string change_text(std::string_view keys, std::string_view effect, std::string_view why) {
  return fmt::format("{} changed, {}{}{}", keys, effect, why.empty() ? "" : ": ", why);
}

std::vector<std::string> key_table() {
  std::vector<std::string> rows;
  for (const TakesEffect when : {at_once, new_server, next_process, next_start, next_manager}) {
    std::string keys;
    std::string_view section;
    for (const ConfigKey& key : kAllKeys) {
      if (key.when != when) continue;
      if (key.section != section) keys += fmt::format("{}{}", keys.empty() ? "" : "; ", key.section);
      keys += fmt::format("{}{}", key.section != section ? " " : ", ", key.name);
      section = key.section;
    }
    rows.push_back(fmt::format("{} | {}", keys, describe(when)));
  }
  return rows;
}

std::vector<KeyChange> changed_keys(const ManagerConfig& before, const ManagerConfig& now) {
  std::vector<KeyChange> changes;
  compare(kHostRows, before.host, now.host, true, changes);
  compare(kDdsRows, before.dds, now.dds, true, changes);
  compare(kBlocksRows, before.blocks, now.blocks, true, changes);
  return changes;
}

std::vector<KeyChange> changed_keys(const InstanceConfig& before, const InstanceConfig& now) {
  std::vector<KeyChange> changes;
  compare(kInstanceRows, before, now, false, changes);
  return changes;
}

void take_over(ManagerConfig& used, const ManagerConfig& now) {
  take_rows(kHostRows, used.host, now.host);
  take_rows(kDdsRows, used.dds, now.dds);
  take_rows(kBlocksRows, used.blocks, now.blocks);
}

}  // namespace plchost
