#pragma once

#include <string>
#include <vector>

#include "api/client/control_client.hpp"
#include "api/plchost_client.hpp"

namespace plchost {

/// The status topics that read_status() knows: all that HostStatus counts.
[[nodiscard]] std::vector<std::string> status_names();
/// All samples of one of them, of one host. invalid_argument: no such topic; lists those that there are.
Async<Result<std::vector<Client::Record>>> read_status(ClientCore& core, std::string topic, std::string host,
                                                       TimePoint deadline);

}  // namespace plchost
