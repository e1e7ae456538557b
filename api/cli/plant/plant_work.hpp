#pragma once

#include <string>
#include <vector>

#include "api/cli/host_selection.hpp"
#include "api/cli/plant/plant_file.hpp"
#include "api/client/control_client.hpp"

namespace plchost {

/// One thing that is not as it is to be, or could not be looked at.
struct PlantFinding {
  enum class Result : std::uint8_t {
    differs,
    done,
    failed,
    missing,  ///< no such host answers
    unknown,  ///< it answers, and what it is cannot be known: no such instance, or no status came
    refused,  ///< it does not have a scheduler that the file names
  };
  Result result = Result::differs;
  std::string host;
  std::string instance;  ///< empty: of the host as a whole
  unsigned line = 0;     ///< of the file
  std::string what;
  std::string is;
  std::string wanted;
  std::string remark;
};

struct PlantWork {
  bool apply = false;           ///< else only look
  Duration patience{};          ///< for a host to answer
  Duration command_patience{};  ///< for a command to be done
};

/// Looks at all hosts of the plant that are selected, at the same time, and brings them to what they are to
/// be. In the order of the file. If a finding is `refused`, nothing was changed on any host.
[[nodiscard]] std::vector<PlantFinding> work_on(ControlClient& client, const Plant& plant,
                                                const HostSelection& selection, const PlantWork& work);

}  // namespace plchost
