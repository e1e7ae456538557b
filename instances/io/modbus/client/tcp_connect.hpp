#pragma once

#include "instances/io/modbus/config/endpoint.hpp"
#include "instances/io/modbus/threads/stop_event.hpp"
#include "shm/base/result.hpp"
#include "shm/base/time.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost::modbus {

/// A connection as libmodbus expects it: non-blocking, without delay of small packets. timed_out: no answer
/// until `deadline`, or the stop came first; null: no stop counts.
[[nodiscard]] Result<UniqueFd> tcp_connect(const Endpoint& endpoint, TimePoint deadline,
                                           const StopEvent* stop);

}  // namespace plchost::modbus
