#pragma once

#include <string>
#include <vector>

#include "api/client/control_client.hpp"
#include "api/plchost_client.hpp"

namespace plchost {

/// The status topics that read_status() knows: all that HostStatus counts.
[[nodiscard]] std::vector<std::string> status_names();
/// All samples of one of them, of one host. invalid_argument: no such topic; lists those that there are.
[[nodiscard]] Result<std::vector<Client::Record>> read_status(ControlClient& client, const std::string& topic,
                                                              const std::string& host, TimePoint deadline);

}  // namespace plchost
