#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "manager/config/manager_config.hpp"

namespace plchost {

/// When a changed key takes effect.
enum class TakesEffect : std::uint8_t {
  at_once,
  next_process,  ///< with the next process of its instance
  next_manager,  ///< when plchostd starts the next time
};

struct KeyChange {
  std::string key;  ///< "core"; of the host with its section: "[dds] interface"
  TakesEffect when = TakesEffect::at_once;
};

/// The keys of two configurations that differ. Instances are compared one by one, by the second function.
[[nodiscard]] std::vector<KeyChange> changed_keys(const ManagerConfig& before, const ManagerConfig& now);
[[nodiscard]] std::vector<KeyChange> changed_keys(const InstanceConfig& before, const InstanceConfig& now);

}  // namespace plchost
