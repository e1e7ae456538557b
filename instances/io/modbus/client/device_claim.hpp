#pragma once

#include <string>

#include "instances/io/modbus/config/modbus_config.hpp"
#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost::modbus {

// What one process of this machine alone may have, however many files name it. The kernel ends a claim with
// its process.

/// The serial line, as long as what is returned is open. busy: the text names the process that has it.
/// Another error: there is no such line, or it cannot be opened.
[[nodiscard]] Result<UniqueFd> claim_line(const std::string& path);

/// The outputs of a device on TCP; invalid: it has none. busy: the text names the process that writes them.
[[nodiscard]] Result<UniqueFd> claim_outputs(const DeviceConfig& device);
/// Ends the connections of those who have looked whose the outputs are; there is room for some only.
void end_looks(const UniqueFd& claim) noexcept;

}  // namespace plchost::modbus
