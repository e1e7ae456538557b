#include "schedulers/tick/tick_choice.hpp"

#include <utility>

#include <fmt/format.h>

namespace plchost {

namespace {

Result<std::shared_ptr<TickDevice>> device_for(const SchedulerSettings& settings, DeviceFiles& files,
                                               const std::shared_ptr<TickDevice>& known) {
  auto device = known;
  if (!device || device->path() != settings.auxiliary_device) {
    PLCHOST_TRY_ASSIGN(device, TickDevice::open(files, settings.auxiliary_device));
  }
  PLCHOST_TRY(device->set_period(settings.scheduler_interval));
  return device;
}

}  // namespace

TickChoice choose_tick(const SchedulerSettings& settings, DeviceFiles& files,
                       const std::shared_ptr<TickDevice>& known) {
  TickChoice choice{.kind = settings.tick_source, .device = {}, .fallback = {}};
  if (settings.tick_source != TickSourceKind::auxiliary) return choice;
  auto device = device_for(settings, files, known);
  if (!device) {
    choice.kind = TickSourceKind::system;
    choice.fallback = device.error().describe();
    return choice;
  }
  choice.device = *std::move(device);
  return choice;
}

Result<void> check_one_shot(std::string_view scheduler, const TickChoice& choice) {
  if (choice.kind != TickSourceKind::auxiliary) return {};
  return failure(
      ErrorCode::unsupported,
      fmt::format("{} sets its timer to another time in each cycle, but {} only has frequencies {} and ticks "
                  "only periodically: use the timer source System or Task",
                  scheduler, choice.device->path(), choice.device->frequencies()));
}

TickReport report_of(const TickChoice& choice) {
  if (choice.kind == TickSourceKind::task) return {.source = "Task", .fallback = {}};
  if (choice.kind == TickSourceKind::system) return {.source = "System", .fallback = choice.fallback};
  const TickFault fault = choice.device->fault();
  if (fault == TickFault::none) return {.source = choice.device->describe(), .fallback = {}};
  return {.source = "System", .fallback = fmt::format("{} {}", choice.device->path(), to_string(fault))};
}

}  // namespace plchost
