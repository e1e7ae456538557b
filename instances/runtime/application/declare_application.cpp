#include "instances/runtime/application/declare_application.hpp"

#include <utility>

#include "instances/runtime/device/device_events.hpp"

namespace plchost {

Result<Application> declare_application(const std::string& path, const InstanceSettings& settings,
                                        const std::optional<DeviceDescription>& device,
                                        ApplicationHost& host) {
  auto application = Application::load(path, host);
  if (!application) return application;
  if (device) {
    if (auto known = check_device_events(*device, application->tasks()); !known)
      return std::unexpected(std::move(known).error());
  }
  if (auto applied = application->apply(settings.tasks); !applied)
    return std::unexpected(std::move(applied).error());
  return application;
}

Areas::Environment areas_environment(const LaunchOptions& launch, const InstanceSettings& settings,
                                     const Application& application, ObjectPool* pool) {
  const std::string& directory = settings.retain.directory;
  return {.pool = pool,
          .instance = launch.name,
          .application = application.name(),
          .settings = settings.areas,
          .retain = {.directory = directory.empty() ? launch.state_directory : directory,
                     .interval = settings.retain.interval,
                     .mismatch = settings.retain.mismatch,
                     .postpone = settings.retain.postpone,
                     .cold = launch.start_kind == StartKind::cold}};
}

// TimerMode=OneShot is the seed's way to ask for distributed clocks; whoever names a scheduler gets that.
std::string scheduler_for(const std::string& asked, const InstanceSettings& settings) {
  if (!asked.empty()) return asked;
  return settings.timer_mode == TimerMode::one_shot ? "CmpScheduleOneShot" : "CmpSchedule";
}

}  // namespace plchost
