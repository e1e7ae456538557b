#pragma once

#include <string>
#include <vector>

#include "manager/config/manager_config.hpp"
#include "shm/base/result.hpp"
#include "shm/toml/toml_document.hpp"

namespace plchost {

/// Where the keys of one instance stand that others are compared with.
struct InstanceLines {
  unsigned name = 0;
  unsigned core = 0;
  unsigned after = 0;
};
using ConfigLines = std::vector<InstanceLines>;

/// Faults that only show when all instances are known: names twice, cores not allowed or shared without
/// saying so, `after` naming nobody or going in a circle.
void check_relations(const ManagerConfig& config, const ConfigLines& lines, const std::vector<int>& online,
                     std::vector<ConfigProblem>& problems);

/// The folder is there and can be written, or its nearest parent that is there can. The error names which.
[[nodiscard]] Result<void> check_directory_can_be_made(const std::string& path);

}  // namespace plchost
