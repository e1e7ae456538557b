#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "api/client/client_core.hpp"
#include "api/dds/variable_page.hpp"
#include "api/plchost_client.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The variables that the query names, with their values of one moment. full: they are more than one page.
Async<Result<Client::Sample>> read_sample(ClientCore& core, std::string host, std::string instance,
                                          VariableQuery query, TimePoint deadline);

/// Throws invalid_argument if samples cannot be taken so often, or so seldom.
void check_sample_interval(std::chrono::milliseconds interval);
/// Throws invalid_argument if one of the patterns can match nothing, or if they are too long.
[[nodiscard]] VariableQuery checked_query(const std::vector<std::string>& patterns);

}  // namespace plchost
