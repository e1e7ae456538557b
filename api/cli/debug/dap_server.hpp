#pragma once

#include <cstdint>

#include "api/cli/debug/debug_link.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// Serves the Debug Adapter Protocol on a port of the loopback interface, one client after the other, until
/// Ctrl-C. A client that comes while another one is served is told so and refused. `port` 0: any free one; it
/// is printed. An error: the port cannot be had.
[[nodiscard]] Result<void> serve_dap(DebugLink& link, std::uint16_t port, bool take);

}  // namespace plchost
