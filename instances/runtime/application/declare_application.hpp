#pragma once

#include <optional>
#include <span>
#include <string>

#include "instances/launch/launch_contract.hpp"
#include "instances/runtime/application/application.hpp"
#include "instances/runtime/application/application_host.hpp"
#include "instances/runtime/application/components.hpp"
#include "instances/runtime/settings/device_description.hpp"
#include "instances/runtime/settings/settings.hpp"

namespace plchost {

// The steps that a start and its trial have in common: the settings, what stands ready before the application
// is loaded, and what the application declares.

/// The settings and the device description of a start.
struct StartSettings {
  InstanceSettings settings;
  std::optional<DeviceDescription> device;  ///< nothing: any external event is allowed
  std::string file;                         ///< the settings file; empty: there is none
  SettingsTexts texts;                      ///< of this file, and of those that it refers to
};

/// The file of `launch` may be empty. The error names file, line and key. Set-up.
[[nodiscard]] Result<StartSettings> read_start_settings(const LaunchOptions& launch);

/// Hands the parameters over, registers the events of the device description, and takes the instance's place
/// among the nodes. A host without a pool does both as far as nothing of the pool is needed. Set-up.
[[nodiscard]] Result<void> prepare_host(const StartSettings& start, ApplicationHost& host);

/// Whether the hooks of the components take what they need, or only say whether they could.
enum class ComponentHooks : bool { check, init };

/// Loads the components, has [SysTime] checked and used, and calls the hooks. Their log is written.
/// `own_time`: see use_system_time(). Set-up.
[[nodiscard]] Result<void> load_components(const InstanceSettings& settings, ComponentHooks hooks,
                                           Components& components, ApplicationHost& host,
                                           std::span<const PF_SYSTIME> own_time);

/// Loads it, has it declare itself to `host`, applies the settings of its tasks, and checks the declaration
/// as a whole: tasks, external events, uses of areas. Another version of the application that runs is loaded
/// beside that, and is gone again after an error, which is the first thing that is wrong. Then follows a
/// commit: ApplicationHost::reserve(), Areas::place() at the first load or OnlineChange::take_over(),
/// ApplicationHost::commit(). Set-up.
[[nodiscard]] Result<DeclaredApplication> declare_application(const std::string& path,
                                                              const StartSettings& start,
                                                              ApplicationHost& host);

/// For Areas::check() and Areas::place(). `application` and `settings` outlive it; `pool` may be null.
[[nodiscard]] Areas::Environment areas_environment(const LaunchOptions& launch,
                                                   const InstanceSettings& settings,
                                                   const Application& application, ObjectPool* pool);

/// The scheduler that `asked` and the settings lead to; `asked` may be empty.
[[nodiscard]] std::string scheduler_for(const std::string& asked, const InstanceSettings& settings);

}  // namespace plchost
