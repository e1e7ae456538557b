#include "instances/runtime/application/application.hpp"

#include <array>
#include <bit>
#include <exception>
#include <utility>

#include <fmt/format.h>

#include "instances/runtime/application/build_of.hpp"
#include "instances/runtime/tasks/task_builder.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

constexpr std::array<std::string_view, 1> kExports = {"plc_app_init"};

Result<void> call_init(const SharedObject& object) {
  using Init = int (*)();
  const auto init = std::bit_cast<Init>(object.find("plc_app_init"));
  try {
    const int result = init();
    if (result == 0) return {};
    return failure(
        ErrorCode::refused,
        fmt::format("{}: plc_app_init returned {} (the application refused to start; 0 is success)",
                    object.path(), result));
  } catch (const std::exception& error) {
    return failure(ErrorCode::refused,
                   fmt::format("{}: plc_app_init threw: {}", object.path(), printable(error.what())));
  } catch (...) {
    return failure(ErrorCode::refused, fmt::format("{}: plc_app_init threw an exception", object.path()));
  }
}

using Exit = void (*)();

// Null: it has none.
Exit exit_of(const SharedObject& object) {
  return std::bit_cast<Exit>(object.find("plc_app_exit"));
}

void call_exit(Exit exit, const std::string& path) {
  if (exit == nullptr) return;
  try {
    exit();
  } catch (const std::exception& error) {
    spdlog::error("{}: plc_app_exit threw: {}", path, error.what());
  } catch (...) {
    spdlog::error("{}: plc_app_exit threw an exception", path);
  }
}

void call_exit(const SharedObject& object) {
  call_exit(exit_of(object), object.path());
}

// Another version of the application runs.
void unload_version(SharedObject& object, ApplicationHost& host) {
  object.unload();
  host.end_version();
}

// Its plc_app_init has returned 0.
void end_program(SharedObject& object, ApplicationHost& host) {
  if (!host.has_application()) {
    return host.refuse([exit = exit_of(object), path = object.path()] { call_exit(exit, path); });
  }
  host.set_online_change(true);
  call_exit(object);
  host.set_online_change(false);
  host.write_messages();
  unload_version(object, host);
}

}  // namespace

Result<DeclaredApplication> Application::load(const std::string& path, ApplicationHost& host) {
  const bool beside = host.has_application();
  PLCHOST_TRY_ASSIGN(auto object,
                     beside ? SharedObject::load_copy(path, kExports) : SharedObject::load(path, kExports));
  std::string build = build_of(path);
  ApplicationDeclaration declaration;
  host.begin_init(declaration);
  auto called = call_init(object);
  host.end_init();
  host.write_messages();  // its own error goes before ours
  if (!called) {
    if (beside) unload_version(object, host);
    return std::unexpected(called.error());
  }
  auto made = built(object, std::move(build), declaration);
  if (made) return DeclaredApplication{*std::move(made), std::move(declaration)};
  end_program(object, host);
  return std::unexpected(std::move(made).error());
}

Result<Application> Application::built(SharedObject& object, std::string build,
                                       const ApplicationDeclaration& declaration) {
  const std::string path = object.path();
  if (declaration.tasks == nullptr) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("{}: plc_app_init did not call __sys__setup__tasks: it has no tasks", path));
  }
  if (declaration.tasks_given_twice) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("{}: plc_app_init called __sys__setup__tasks more than once", path));
  }
  TaskCodes codes;
  PLCHOST_TRY_ASSIGN(auto tasks, in_step(path, build_tasks(*declaration.tasks, codes)));
  PLCHOST_TRY(in_step(path, apply_task_settings(declaration.task_options, tasks)));
  return Application(std::move(object), std::move(build), *declaration.tasks, std::move(tasks),
                     std::move(codes));
}

void Application::exchange(Application& next) noexcept {
  std::swap(object_, next.object_);
  std::swap(build_, next.build_);
  std::swap(setup_, next.setup_);
}

void Application::exit() {
  call_exit(object_);
}

void Application::leave(ApplicationHost& host) {
  end_program(object_, host);
}

std::string Application::name() const {
  return static_cast<const char*>(setup_->stApplicationName);
}

}  // namespace plchost
