#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "manager/config/manager_config.hpp"

namespace plchost {

/// When a changed key takes effect. In the order in which tables list them.
enum class TakesEffect : std::uint8_t {
  at_once,
  new_server,    ///< at once; plchost-dds is restarted for it
  next_process,  ///< with the next process of its instance
  next_start,    ///< when the host starts the next time: it says how the host starts, nothing else
  next_manager,  ///< when plchostd is restarted
};

/// One key of the configuration file.
struct ConfigKey {
  std::string_view section;  ///< "[host]"
  std::string_view name;
  TakesEffect when = TakesEffect::at_once;
  std::string_view why = {};  ///< the reason against an earlier effect; empty: nothing to add
};

/// All keys, in the order of the file.
[[nodiscard]] std::span<const ConfigKey> all_config_keys() noexcept;
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
