#include "instances/runtime/application/application_check.hpp"

#include <cstdio>
#include <deque>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "instances/launch/launch_contract.hpp"
#include "instances/runtime/application/application.hpp"
#include "instances/runtime/application/components.hpp"
#include "instances/runtime/application/declare_application.hpp"
#include "instances/runtime/device/device_description.hpp"
#include "instances/runtime/settings/settings.hpp"
#include "schedulers/task_set.hpp"
#include "schedulers/tick/device_file.hpp"
#include "shm/base/names.hpp"
#include "shm/pool/instance_page.hpp"

namespace plchost {

namespace {

std::string detail_of(const TaskConfig& task) {
  switch (task.kind) {
    case TaskKind::cyclic:
      return fmt::format(", every {} us",
                         std::chrono::duration_cast<std::chrono::microseconds>(task.interval).count());
    case TaskKind::external:
      return fmt::format(", event {}", task.external_event);
    case TaskKind::event:
    case TaskKind::freewheeling:
      return {};
  }
  return {};
}

// No clock device is taken from an instance that has it.
class NoDevices : public DeviceFiles {
 public:
  [[nodiscard]] Result<std::unique_ptr<DeviceFile>> open(const std::string& path) override {
    return failure(ErrorCode::unavailable, path + " is not tried");
  }
};

// The tasks with their threads, which stay parked, under the scheduler that they are to have.
Result<void> try_tasks(const Options& options, const InstanceSettings& settings,
                       const Application& application) {
  LinuxClock clock;
  NoDevices no_devices;
  std::deque<CountedEvent> events;
  std::vector<TaskStatistics> statistics(application.tasks().size());
  TaskEnvironment environment{
      .find_event = [&](std::string_view) -> Result<CountedEvent*> { return &events.emplace_back(); },
      .statistics = [&](std::size_t index) -> TaskStatistics& { return statistics[index]; },
      .fault_record = {},
      .state_changed = {},
      .to_park = {},
      .catch_faults = false,
      .allow_unprivileged = true,
      .devices = &no_devices,
  };
  auto tasks = TaskSet::create(clock, options.band, application.tasks(), std::move(environment));
  if (!tasks) return std::unexpected(std::move(tasks).error());
  SchedulerSettings scheduler = settings.scheduler;
  scheduler.tick_source = TickSourceKind::system;
  return (*tasks)->check(scheduler_for(options.launch.scheduler, settings), scheduler);
}

// All that a start does, by the same functions in the same order, as far as it takes nothing from the
// instance that runs: hooks of components are not called, and memories, files and devices are only looked at.
Result<Application> try_start(const Options& options, Components& components, ApplicationHost& host) {
  const LaunchOptions& launch = options.launch;
  auto settings = launch.settings.empty() ? Result<InstanceSettings>() : read_settings(launch.settings);
  if (!settings) return std::unexpected(std::move(settings).error());
  std::optional<DeviceDescription> device;
  if (!settings->device_description.empty()) {
    auto read = read_device_description(settings->device_description);
    if (!read) return std::unexpected(std::move(read).error());
    device = *std::move(read);
  }
  if (auto loaded = components.load(settings->components); !loaded) return std::unexpected(loaded.error());
  auto application = declare_application(options.check_application, *settings, device, host);
  if (!application) return application;
  // There is none before the first start, and none for who may not look into it.
  auto pool = ObjectPool::attach(launch.pool, ObjectPool::Access::read_only);
  const auto environment = areas_environment(launch, *settings, *application, pool ? &*pool : nullptr);
  if (auto good = host.areas().check(environment, application->tasks()); !good)
    return std::unexpected(std::move(good).error());
  if (auto good = try_tasks(options, *settings, *application); !good)
    return std::unexpected(std::move(good).error());
  return application;
}

}  // namespace

int check_application(const Options& options) {
  const std::string& path = options.check_application;
  Components components;
  ApplicationHost host("check", nullptr);
  host.set_start_kind(static_cast<int>(options.launch.start_kind));
  const auto application = try_start(options, components, host);
  if (!application) {
    fmt::print(stderr, "{}\n", application.error().describe());
    return kExitSetupFailed;
  }
  fmt::print("{}{}{}, {} tasks\n", path, kValidApplication, printable(application->name()),
             application->tasks().size());
  for (const TaskConfig& task : application->tasks()) {
    fmt::print("  {}: {}, priority {}{}\n", task.name, to_string(static_cast<PageTaskKind>(task.kind)),
               task.iec_priority, detail_of(task));
  }
  // Destructors of the application may end the process without.
  (void)std::fflush(stdout);
  return 0;
}

}  // namespace plchost
