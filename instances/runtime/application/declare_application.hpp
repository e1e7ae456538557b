#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "instances/launch/launch_contract.hpp"
#include "instances/runtime/application/application.hpp"
#include "instances/runtime/application/application_host.hpp"
#include "instances/runtime/application/components.hpp"
#include "instances/runtime/settings/device_description.hpp"
#include "instances/runtime/settings/settings.hpp"
#include "instances/runtime/settings/settings_source.hpp"

namespace plchost {

// The steps that a start, its trial and an online change have in common. They are the settings, what stands
// ready before the application is loaded, its declaration, and the commit of that.

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

/// The surroundings in which an application is declared and committed. All of it outlives that.
struct LoadContext {
  const LaunchOptions& launch;
  const StartSettings& start;
  ApplicationHost& host;
  ObjectPool* pool = nullptr;  ///< null: a trial before the first start
};

/// Loads it, has it declare itself to the host, and applies the settings of its tasks. Checks the declaration
/// as a whole: external events, tasks, uses of areas, and at a first load whether the areas can be placed.
/// Another version of the application that runs is loaded beside that, and is gone again after an error,
/// which is the first thing that is wrong. Changes nothing else, but that the first channel makes the
/// instance a node at once: it stays one after an error. Set-up.
[[nodiscard]] Result<DeclaredApplication> declare_application(const std::string& path,
                                                              const LoadContext& context);

/// Makes a declaration hold that was checked as a whole: at a first load, and in an online change. Control
/// thread. An online change exchanges the variables that are seen from outside by itself, as the last step of
/// its take-over.
class Commit {
 public:
  /// Takes all steps that can fail: registers the events that are new and, at a first load, places the areas
  /// around the cycles of `application`. Another version gets the addresses of those that go on. After an
  /// error nothing of it is left. Set-up.
  [[nodiscard]] static Result<Commit> prepare(const LoadContext& context, Application& application,
                                              ApplicationDeclaration declaration);
  Commit(Commit&& other) noexcept
      : host_(std::exchange(other.host_, nullptr)),
        declaration_(std::move(other.declaration_)),
        remark_(std::move(other.remark_)) {}
  Commit& operator=(Commit&&) = delete;
  /// Without hold() the events are unregistered again.
  ~Commit();

  /// Of the areas; empty: there is nothing to say.
  [[nodiscard]] const std::string& remark() const noexcept { return remark_; }
  [[nodiscard]] const ApplicationDeclaration& declaration() const noexcept { return declaration_; }
  /// The declaration holds from now on. Once. `is_code`: see ApplicationHost::commit().
  void hold(const std::function<bool(const void*)>& is_code);

 private:
  Commit(ApplicationHost& host, ApplicationDeclaration declaration)
      : host_(&host), declaration_(std::move(declaration)) {}

  ApplicationHost* host_;  // null: it holds, or was moved away
  ApplicationDeclaration declaration_;
  std::string remark_;
};

/// The scheduler of a fresh process: `asked` by its start, else that of the settings, else `preferred` by the
/// application. Both may be empty.
[[nodiscard]] std::string scheduler_for(const std::string& asked, const InstanceSettings& settings,
                                        const std::string& preferred = {});

}  // namespace plchost
