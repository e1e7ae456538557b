#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "api/cli/plant/plant_file.hpp"

namespace plchost {

/// The state of an instance, as its host tells it.
struct PresentInstance {
  std::uint32_t state = 0;  ///< as InstanceStatus.state
  std::string scheduler;
  std::string application;
  std::set<std::string> events;  ///< that are registered
};

/// Something that is not as it is to be, and the operation that brings it there.
struct PlantChange {
  std::string what;  ///< "application", "scheduler", "event NAME", "state"
  std::string is;
  std::string wanted;
  std::int32_t operation = 0;  ///< plc_OPERATION_...
  std::string argument;
};

/// All of them, in the order in which they are done: stops first, starts last. Some show only when others are
/// done (a loaded application runs, and is to be stopped): look again after them.
[[nodiscard]] std::vector<PlantChange> changes_to(const WantedInstance& wanted,
                                                  const PresentInstance& present);

}  // namespace plchost
