#include <array>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <linux/rtc.h>

#include "instances/launch/launch_contract.hpp"
#include "instances/runtime/application/application.hpp"
#include "instances/runtime/application/components.hpp"
#include "instances/runtime/application/declare_application.hpp"
#include "instances/runtime/blocks/block_service.hpp"
#include "instances/runtime/settings/settings.hpp"
#include "instances/runtime/setup/process_setup.hpp"
#include "instances/runtime/setup/sandbox.hpp"
#include "instances/runtime/setup/set_up_watch.hpp"
#include "instances/runtime/trial/trial.hpp"
#include "schedulers/task_set.hpp"
#include "schedulers/tick/device_file.hpp"
#include "shm/base/names.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/pool/pool_room.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

namespace {

std::string detail_of(const TaskConfig& task) {
  std::string detail;
  if (task.interval > Duration::zero()) {
    detail += fmt::format(", every {} us",
                          std::chrono::duration_cast<std::chrono::microseconds>(task.interval).count());
  }
  if (!task.external_event.empty()) detail += fmt::format(", event {}", task.external_event);
  return detail;
}

/// A clock with periodic interrupts that another process has: of its answers only the kind is known.
class ClockOfAnother : public DeviceFile {
 public:
  explicit ClockOfAnother(bool is_rtc) noexcept : is_rtc_(is_rtc) {}
  [[nodiscard]] int control(unsigned long request, unsigned long) noexcept override {
    return request == RTC_IRQP_READ && !is_rtc_ ? ENOTTY : 0;
  }
  [[nodiscard]] Wait wait(TimePoint) noexcept override { return Wait::interrupted; }
  [[nodiscard]] std::optional<unsigned long> read() noexcept override { return std::nullopt; }
  void interrupt() noexcept override {}

 private:
  bool is_rtc_;
};

// A clock device can be opened once only, so none is taken from an instance that has it. The instance to be
// tried may be that one, and then gets it.
class TrialDevices : public DeviceFiles {
 public:
  [[nodiscard]] Result<std::unique_ptr<DeviceFile>> open(const std::string& path) override {
    auto device = linux_device_files().open(path);
    if (!device && device.error().system_errno == EBUSY) {
      return std::make_unique<ClockOfAnother>(path.find("hpet") == std::string::npos);
    }
    return device;
  }
};

// The kernel's answer, without staying there: the trial takes no time from the core of the instance.
Result<void> try_cores(const std::vector<int>& cores) {
  PLCHOST_TRY_ASSIGN(const auto before, allowed_cores(0));
  const auto granted = bind_to_cores(cores);
  const auto back = bind_to_cores(before);
  PLCHOST_TRY(granted);
  PLCHOST_TRY(back);
  return {};
}

// Nothing: there is no pool before the first start, and none for a process that may not look into it.
std::optional<PoolRoom> room_in_pool(const LaunchOptions& launch, const std::optional<ObjectPool>& pool) {
  if (!pool) return std::nullopt;
  const auto page = InstancePageReader::open(launch.pool, launch.name);
  const auto runtime = page ? page->runtime() : std::nullopt;
  auto room = PoolRoom::of(*pool, launch.name, runtime ? runtime->pid : 0);
  return room ? std::optional(*std::move(room)) : std::nullopt;
}

// The tasks with their threads, which stay parked, under the scheduler that they are to have.
Result<void> try_tasks(const Options& options, const InstanceSettings& settings,
                       const DeclaredApplication& declared, ApplicationHost& host) {
  const Application& application = declared.application;
  LinuxClock clock;
  TrialDevices devices;
  std::vector<TaskStatistics> statistics(application.tasks().size());
  TaskEnvironment environment{
      .find_event = [&](std::string_view event) { return host.events().bind_task(event); },
      .statistics = [&](std::size_t index) -> TaskStatistics& { return statistics[index]; },
      .fault_record = {},
      .state_changed = {},
      .to_park = {},
      .catch_faults = false,
      .allow_unprivileged = true,
      .devices = &devices,
  };
  PLCHOST_TRY_ASSIGN(const auto tasks,
                     TaskSet::create(clock, options.band, application.tasks(), std::move(environment)));
  PLCHOST_TRY(tasks->prepare(
      scheduler_for(options.launch.scheduler, settings, declared.declaration.scheduler), settings.scheduler));
  return {};
}

// The part that runs code of components and of the application.
Result<DeclaredApplication> declare_watched(const std::string& path, const LoadContext& context,
                                            Components& components) {
  const InstanceSettings& settings = context.start.settings;
  // Without a real-time priority: the trial may run on the core of an instance.
  SetUpWatch watch(settings.scheduler.watchdog.default_time, {}, [&](const Error& error) {
    fmt::print(stderr, "{}: {}\n", path, error.describe());
    end_trial(kExitSetupFailed);
  });
  constexpr std::array<PF_SYSTIME, 2> kOwnTime = {SysTimeGetUs, SysTimeGetNs};
  PLCHOST_TRY(load_components(settings, ComponentHooks::check, components, context.host, kOwnTime));
  PLCHOST_TRY(confine_to_load(settings.seccomp));
  auto declared = declare_application(path, context);
  if (auto ended = watch.end(); !ended && declared) return std::unexpected(std::move(ended).error());
  return declared;
}

// All that a start does, by the same functions in the same order, as far as it takes nothing from the
// instance that runs. Some things are free only when that instance has ended: its name, its control socket
// and its status page, and the resources of its components' CH_INIT.. hooks. Its address among the nodes, its
// memories and outputs are only looked at. If one of these fails, the manager takes the start back.
Result<DeclaredApplication> try_start(const Options& options, Components& components, ApplicationHost& host) {
  const LaunchOptions& launch = options.launch;
  PLCHOST_TRY(try_cores(launch.cores));
  PLCHOST_TRY_ASSIGN(const auto start, read_start_settings(launch));
  PLCHOST_TRY(BlockService::check(launch.pool, launch.name, start.settings.blocks));
  auto attached = ObjectPool::attach(launch.pool, ObjectPool::Access::read_only);
  std::optional<ObjectPool> pool;
  if (attached) pool.emplace(*std::move(attached));
  if (auto room = room_in_pool(launch, pool)) host.events().look_for_room(*std::move(room));
  PLCHOST_TRY(prepare_host(start, host));
  const LoadContext context{.launch = launch, .start = start, .host = host, .pool = pool ? &*pool : nullptr};
  auto declared = declare_watched(options.check_application, context, components);
  if (!declared) return declared;
  PLCHOST_TRY(host.reserve(declared->declaration));
  PLCHOST_TRY(try_tasks(options, start.settings, *declared, host));
  return declared;
}

}  // namespace

int check_application(const Options& options) {
  const std::string& path = options.check_application;
  Components components;
  ApplicationHost host(options.launch.name, nullptr);
  host.set_start_kind(static_cast<int>(options.launch.start_kind));
  const auto declared = try_start(options, components, host);
  if (!descriptors_are_open()) {
    fmt::print(stderr, "{}: it closes descriptors in its set-up that it has not opened\n", path);
    return kExitSetupFailed;
  }
  if (!declared) {
    fmt::print(stderr, "{}\n", declared.error().describe());
    return kExitSetupFailed;
  }
  const Application& application = declared->application;
  fmt::print("{}{}{}, {}\n", path, kValidApplication, printable(application.name()),
             count_text(application.tasks().size(), "task"));
  for (const TaskConfig& task : application.tasks()) {
    fmt::print("  {}: {}, priority {}{}\n", task.name, traits_of(task.kind).name, task.iec_priority,
               detail_of(task));
  }
  // Destructors of the application may end the process without.
  (void)std::fflush(stdout);
  return 0;
}

}  // namespace plchost
