#include "instances/runtime/application/application_check.hpp"

#include <cstdio>

#include <fmt/format.h>

#include "instances/launch/launch_contract.hpp"
#include "instances/runtime/application/application.hpp"
#include "instances/runtime/device/device_description.hpp"
#include "instances/runtime/device/device_events.hpp"
#include "instances/runtime/settings/settings.hpp"
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

// The same as at a start, in the same order: what is found here would end the instance there.
Result<void> check_under(const InstanceSettings& settings, Application& application, ApplicationHost& host) {
  if (!settings.device_description.empty()) {
    const auto device = read_device_description(settings.device_description);
    if (!device) return std::unexpected(device.error());
    if (auto known = check_device_events(*device, application.tasks()); !known) return known;
  }
  if (auto applied = application.apply(settings.tasks); !applied) return applied;
  return host.areas().check(settings.areas, application.tasks());
}

Result<Application> load_under(const std::string& path, const std::string& file, ApplicationHost& host) {
  auto settings = file.empty() ? Result<InstanceSettings>() : read_settings(file);
  if (!settings) return std::unexpected(std::move(settings).error());
  auto application = Application::load(path, host);
  if (!application) return application;
  if (auto good = check_under(*settings, *application, host); !good) return std::unexpected(good.error());
  return application;
}

}  // namespace

int check_application(const std::string& path, const std::string& settings) {
  ApplicationHost host("check", nullptr);
  const auto application = load_under(path, settings, host);
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
