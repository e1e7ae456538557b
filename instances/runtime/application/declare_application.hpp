#pragma once

#include <optional>
#include <string>

#include "instances/launch/launch_contract.hpp"
#include "instances/runtime/application/application.hpp"
#include "instances/runtime/application/application_host.hpp"
#include "instances/runtime/device/device_description.hpp"
#include "instances/runtime/settings/settings.hpp"

namespace plchost {

// The common part of a start and its trial: what an application declares, and the settings it is to run
// under.

/// Loads it, has it declare itself to `host`, and applies the settings of its tasks. The error is the first
/// thing that is wrong. Set-up.
[[nodiscard]] Result<Application> declare_application(const std::string& path,
                                                      const InstanceSettings& settings,
                                                      const std::optional<DeviceDescription>& device,
                                                      ApplicationHost& host);

/// For Areas::check() and Areas::place(). `application` and `settings` outlive it; `pool` may be null.
[[nodiscard]] Areas::Environment areas_environment(const LaunchOptions& launch,
                                                   const InstanceSettings& settings,
                                                   const Application& application, ObjectPool* pool);

/// The scheduler that `asked` and the settings lead to; `asked` may be empty.
[[nodiscard]] std::string scheduler_for(const std::string& asked, const InstanceSettings& settings);

}  // namespace plchost
