#pragma once

#include <string>
#include <vector>

#include "api/client/control_client.hpp"
#include "api/plchost_client.hpp"

namespace plchost {

/// The status topics that read_status() knows: all that HostStatus counts.
[[nodiscard]] std::vector<std::string> status_names();
/// invalid_argument: no such topic; lists those that there are.
[[nodiscard]] Result<void> check_status_name(const std::string& topic);
/// The values of a record's keys. Only for a topic that there is.
[[nodiscard]] std::vector<Client::Value> status_key(const std::string& topic, const Client::Record& record);
/// All samples of one of them, of one host. invalid_argument: as check_status_name().
Async<Result<std::vector<Client::Record>>> read_status(ClientCore& core, std::string topic, std::string host,
                                                       TimePoint deadline);

}  // namespace plchost
