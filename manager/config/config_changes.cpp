#include "manager/config/config_changes.hpp"

#include <fmt/format.h>

namespace plchost {

namespace {

using enum TakesEffect;

template <class Use>
void for_each_key(const Use& use) {
  for (const auto& row : host_keys()) use(row.key);
  for (const auto& row : dds_keys()) use(row.key);
  for (const auto& row : blocks_keys()) use(row.key);
  for (const auto& row : instance_keys()) use(row.key);
}

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

std::vector<ConfigKey> all_config_keys() {
  std::vector<ConfigKey> all;
  for_each_key([&](const ConfigKey& key) { all.push_back(key); });
  return all;
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
      return "used when plchostd is stopped, which ends the instances, and started";
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
    for_each_key([&](const ConfigKey& key) {
      if (key.when != when) return;
      if (key.section != section) keys += fmt::format("{}{}", keys.empty() ? "" : "; ", key.section);
      keys += fmt::format("{}{}", key.section != section ? " " : ", ", key.name);
      section = key.section;
    });
    rows.push_back(fmt::format("{} | {}", keys, describe(when)));
  }
  return rows;
}

std::vector<KeyChange> changed_keys(const ManagerConfig& before, const ManagerConfig& now) {
  std::vector<KeyChange> changes;
  compare(host_keys(), before.host, now.host, true, changes);
  compare(dds_keys(), before.dds, now.dds, true, changes);
  compare(blocks_keys(), before.blocks, now.blocks, true, changes);
  return changes;
}

std::vector<KeyChange> changed_keys(const InstanceConfig& before, const InstanceConfig& now) {
  std::vector<KeyChange> changes;
  compare(instance_keys(), before, now, false, changes);
  return changes;
}

void take_over(ManagerConfig& used, const ManagerConfig& now) {
  take_rows(host_keys(), used.host, now.host);
  take_rows(dds_keys(), used.dds, now.dds);
  take_rows(blocks_keys(), used.blocks, now.blocks);
}

}  // namespace plchost
