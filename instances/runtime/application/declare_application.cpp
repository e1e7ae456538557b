#include "instances/runtime/application/declare_application.hpp"

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "instances/runtime/application/elf_check.hpp"
#include "instances/runtime/settings/read_settings.hpp"
#include "instances/runtime/tasks/registered_events.hpp"
#include "instances/runtime/time/system_time.hpp"
#include "shm/base/transient.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

// Into `start`: the settings and their texts, from the files or as the process before has kept them.
Result<void> read_settings_of(const LaunchOptions& launch, StartSettings& start) {
  start.file = launch.settings;
  Result<InstanceSettings> settings;
  std::optional<KeptSettings> kept;
  if (launch.kept_settings) {
    auto found = read_kept_settings(kept_settings_path(launch.run_directory, launch.name));
    if (!found && is_transient(found.error())) return std::unexpected(std::move(found).error());
    // The run directory is empty after a power cut, and a process of an older version keeps nothing there.
    if (!found) spdlog::warn("settings: those of today are read instead: {}", found.error().describe());
    if (found) kept = *std::move(found);
  }
  if (kept) {
    start.file = kept->file();
    start.texts = kept->texts();
    if (!start.file.empty()) settings = read_settings(start.file, *kept);
  } else if (!start.file.empty()) {
    SettingsFiles files;
    settings = read_settings(start.file, files);
    start.texts = files.texts();
  }
  PLCHOST_TRY_ASSIGN(start.settings, std::move(settings));
  return {};
}

}  // namespace

Result<StartSettings> read_start_settings(const LaunchOptions& launch) {
  StartSettings start;
  PLCHOST_TRY(read_settings_of(launch, start));
  if (!start.settings.device_description.empty()) {
    PLCHOST_TRY_ASSIGN(start.device, read_device_description(start.settings.device_description));
  }
  return start;
}

Result<void> prepare_host(const StartSettings& start, ApplicationHost& host) {
  host.set_parameters(start.settings.parameters);
  if (start.device) {
    if (auto done = register_device_events(*start.device, host.events()); !done) return done;
  }
  return host.blocks().configure(start.settings.blocks);
}

Result<void> load_components(const InstanceSettings& settings, ComponentHooks hooks, Components& components,
                             ApplicationHost& host, std::span<const PF_SYSTIME> own_time) {
  const ApplicationHost::ComponentCode code(host);
  auto loaded = components.load(settings.components);
  if (loaded) {  // a component may hold the clock, and the hooks of all see it
    loaded = use_system_time(settings.sys_time, own_time,
                             [&](const char* symbol) { return components.find(symbol); });
  }
  if (loaded) loaded = hooks == ComponentHooks::init ? components.init() : components.check();
  host.write_messages();
  return loaded;
}

namespace {

Areas::Environment areas_environment(const LoadContext& context, const Application& application) {
  const InstanceSettings& settings = context.start.settings;
  const std::string& directory = settings.retain.directory;
  return {.pool = context.pool,
          .instance = context.launch.name,
          .application = application.name(),
          .settings = settings.areas,
          .retain = {.directory = directory.empty() ? context.launch.state_directory : directory,
                     .interval = settings.retain.interval,
                     .mismatch = settings.retain.mismatch,
                     .postpone = settings.retain.postpone,
                     .cold = context.launch.start_kind == StartKind::cold},
          .room = context.host.events().room(),
          .forces = context.host.variables().slots()};
}

// As a whole: `declared` is complete then.
Result<void> check_declaration(const LoadContext& context, DeclaredApplication& declared) {
  Application& application = declared.application;
  const auto& device = context.start.device;
  if (device) {
    if (auto known = check_device_events(*device, application.tasks()); !known) return known;
  }
  if (auto applied = application.apply(context.start.settings.tasks); !applied) return applied;
  PLCHOST_TRY(check_tasks(application.tasks()));
  std::vector<std::string> names;
  for (const TaskConfig& task : application.tasks()) names.push_back(task.name);
  PLCHOST_TRY(complete_uses(declared.declaration.areas, names));
  PLCHOST_TRY(check_variables(declared.declaration.seen.variables(), names));
  // Those of another version go on where they are: OnlineChange compares them.
  if (context.host.has_application()) return {};
  return Areas::check(areas_environment(context, application), declared.declaration.areas);
}

}  // namespace

namespace {

// Another fault of the file is reported when it is loaded.
Result<void> refuse_debug_build(const std::string& path) {
  const auto bytes = read_program(path);
  if (!bytes) return {};
  const auto debug = is_debug_build(*bytes);
  if (!debug || !*debug) return {};
  return failure(ErrorCode::refused,
                 fmt::format("{} is a debug build, and this host says allow_debug = false: build it without "
                             "--debug",
                             path));
}

}  // namespace

Result<DeclaredApplication> declare_application(const std::string& path, const LoadContext& context) {
  if (context.launch.no_debug) {
    PLCHOST_TRY(refuse_debug_build(path));
  }
  auto declared = Application::load(path, context.host);
  if (!declared) return declared;
  auto checked = check_declaration(context, *declared);
  if (checked) return declared;
  declared->application.leave(context.host);
  return std::unexpected(std::move(checked).error());
}

Result<Commit> Commit::prepare(const LoadContext& context, Application& application,
                               ApplicationDeclaration declaration) {
  ApplicationHost& host = context.host;
  PLCHOST_TRY(host.reserve(declaration));
  Commit commit(host, std::move(declaration));
  if (host.has_application()) {
    host.areas().tell_addresses(commit.declaration_.areas);
    return commit;
  }
  std::vector<std::string> tasks;
  for (const TaskConfig& task : application.tasks()) tasks.push_back(task.name);
  host.variables().place(commit.declaration_.seen.take(), std::move(tasks));
  PLCHOST_TRY_ASSIGN(commit.remark_,
                     host.areas().place(areas_environment(context, application),
                                        std::move(commit.declaration_.areas), application.tasks_to_change()));
  return commit;
}

Commit::~Commit() {
  if (host_ != nullptr) host_->release(declaration_);
}

void Commit::hold(const std::function<bool(const void*)>& is_code) {
  std::exchange(host_, nullptr)->commit(std::move(declaration_), is_code);
}

std::string scheduler_for(const std::string& asked, const InstanceSettings& settings,
                          const std::string& preferred) {
  if (!asked.empty()) return asked;
  if (settings.timer_mode == TimerMode::one_shot || preferred.empty())
    return std::string(scheduler_of(settings.timer_mode));
  return preferred;
}

}  // namespace plchost
