#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "shm/base/result.hpp"

namespace plchost {

/// The external events of a device description (an XML file of the other runtime). Source: seed
/// iec_task_management, "Creating an external event task": of
/// /DeviceDescription/Device/ExtendedSettings/ts:TargetSettings/ts:section[@name='taskconfiguration'] the
/// settings 'supportexternal' and 'externalevents'.
struct DeviceDescription {
  bool supports_external = false;   ///< supportexternal is there, and 1
  std::vector<std::string> events;  ///< in the order of the file; none if they are not supported
};

inline constexpr std::size_t kMaxDeviceDescription = std::size_t{16} << 20;
inline constexpr std::size_t kMaxDeviceEvents = 1024;

/// `file` is how errors call it, "FILE:LINE: the fault, and the allowed values". Parts that have nothing to
/// do with events are not looked at; without the section nothing is supported. Set-up.
[[nodiscard]] Result<DeviceDescription> parse_device_description(std::string_view text,
                                                                 std::string_view file);
/// not_found: no such file. Set-up.
[[nodiscard]] Result<DeviceDescription> read_device_description(const std::string& file);

}  // namespace plchost
