#pragma once

#include <string>
#include <utility>

#include "api/client/control_client.hpp"
#include "api/library/convert.hpp"
#include "shm/base/result.hpp"

namespace plchost {

// Parts of the calls of a Client.

template <class T>
[[nodiscard]] T value_or_throw(Result<T> result) {
  if (!result) throw_client_error(result.error());
  return *std::move(result);
}

/// "INSTANCE/EVENT".
[[nodiscard]] Result<EventId> event_of(const std::string& name);
/// That host, once it answers; no name: the one that the client is for, or the only one.
Async<Result<std::string>> host_of(ClientCore& core, std::string name, TimePoint deadline);

}  // namespace plchost
