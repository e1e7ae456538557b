#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "manager/config/config_table.hpp"
#include "manager/config/manager_config.hpp"

namespace plchost {

/// All keys, in the order of the file.
[[nodiscard]] std::vector<ConfigKey> all_config_keys();
/// "used when plchostd is restarted".
[[nodiscard]] std::string_view describe(TakesEffect when) noexcept;
/// A line of the answer of a reload. `effect`: see describe().
[[nodiscard]] std::string change_text(std::string_view keys, std::string_view effect,
                                      std::string_view why = {});
/// The same for all keys, for help and documentation: rows of a table with the columns keys and effect.
[[nodiscard]] std::vector<std::string> key_table();

struct KeyChange {
  std::string key;  ///< "core"; of the host with its section: "[dds] interface"
  TakesEffect when = TakesEffect::at_once;
  std::string_view why = {};
};

/// The keys of two configurations that differ. Instances are compared one by one, by the second function.
[[nodiscard]] std::vector<KeyChange> changed_keys(const ManagerConfig& before, const ManagerConfig& now);
[[nodiscard]] std::vector<KeyChange> changed_keys(const InstanceConfig& before, const InstanceConfig& now);
/// Gives `used` the values that a running manager takes over; instances are left out.
void take_over(ManagerConfig& used, const ManagerConfig& now);

}  // namespace plchost
