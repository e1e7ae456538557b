#pragma once

#include <string>

#include "api/client/client_core.hpp"
#include "api/dds/variable_page.hpp"
#include "api/plchost_client.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost {

/// The variables that the query names, with their values of one moment. full: they are more than one page.
Async<Result<Client::Sample>> read_sample(ClientCore& core, std::string host, std::string instance,
                                          VariableQuery query, TimePoint deadline);

}  // namespace plchost
