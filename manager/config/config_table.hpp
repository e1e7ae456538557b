#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "manager/config/load_config.hpp"
#include "manager/config/manager_config.hpp"
#include "shm/toml/key_table.hpp"

namespace plchost {

/// When a changed key takes effect. In the order in which tables list them.
enum class TakesEffect : std::uint8_t {
  at_once,
  new_server,    ///< at once; plchost-dds is restarted for it
  next_process,  ///< with the next process of its instance
  next_start,    ///< when the host starts the next time: it says how the host starts, nothing else
  next_manager,  ///< when plchostd is restarted
};

/// One key of the configuration file, as people are told of it.
struct ConfigKey {
  std::string_view section = {};  ///< "[host]"
  std::string_view name;
  TakesEffect when = TakesEffect::at_once;
  std::string_view why = {};  ///< the reason against an earlier effect; empty: nothing to add
  std::string_view initial =
      {};                    ///< the default in words, where the host decides it; empty: that of the struct
  std::string_view meaning;  ///< for the table in manager/configuration.md
};

/// The surroundings of a key that is read.
struct ConfigReading {
  const ConfigSurroundings& surroundings;
  const std::string& folder;    ///< that relative paths start in
  const ManagerConfig& config;  ///< as far as it was read
};

/// One row of the table of keys. Config is the struct of its section.
template <class Config>
using ConfigRow = KeyRow<ConfigKey, Config, ConfigReading>;

// The tables, in the order of the file and of manager/configuration.md. Each member of the struct has its
// row.
[[nodiscard]] std::span<const ConfigRow<HostConfig>> host_keys() noexcept;
[[nodiscard]] std::span<const ConfigRow<DdsConfig>> dds_keys() noexcept;
[[nodiscard]] std::span<const ConfigRow<BlocksConfig>> blocks_keys() noexcept;
[[nodiscard]] std::span<const ConfigRow<InstanceConfig>> instance_keys() noexcept;

/// The table of manager/configuration.md, a line with its end for each row.
[[nodiscard]] std::string config_key_table();

}  // namespace plchost
