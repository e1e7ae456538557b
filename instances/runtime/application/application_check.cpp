#include "instances/runtime/application/application_check.hpp"

#include <cstdio>

#include <fmt/format.h>

#include "instances/launch/launch_contract.hpp"
#include "instances/runtime/application/application.hpp"
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

}  // namespace

int check_application(const std::string& path) {
  ApplicationHost host("check", nullptr);
  const auto application = Application::load(path, host);
  if (!application) {
    fmt::print(stderr, "{}\n", application.error().describe());
    return kExitSetupFailed;
  }
  fmt::print("{}{}{}, {} tasks\n", path, kValidApplication, application->name(), application->tasks().size());
  for (const TaskConfig& task : application->tasks()) {
    fmt::print("  {}: {}, priority {}{}\n", task.name, to_string(static_cast<PageTaskKind>(task.kind)),
               task.iec_priority, detail_of(task));
  }
  // Destructors of the application may end the process without.
  (void)std::fflush(stdout);
  return 0;
}

}  // namespace plchost
