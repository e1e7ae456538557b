#include "instances/runtime/application/application.hpp"

#include <array>
#include <bit>
#include <exception>
#include <utility>

#include <fmt/format.h>

#include "instances/runtime/tasks/task_builder.hpp"
#include "shm/base/log.hpp"

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
                   fmt::format("{}: plc_app_init threw: {}", object.path(), error.what()));
  } catch (...) {
    return failure(ErrorCode::refused, fmt::format("{}: plc_app_init threw an exception", object.path()));
  }
}

}  // namespace

Result<Application> Application::load(const std::string& path, ApplicationHost& host) {
  auto object = SharedObject::load(path, kExports);
  if (!object) return std::unexpected(object.error());
  auto called = call_init(*object);
  host.write_messages();  // what it said about itself goes before what we say
  if (!called) return std::unexpected(called.error());
  if (host.tasks() == nullptr) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("{}: plc_app_init did not call __sys__setup__tasks: it has no tasks", path));
  }
  if (host.tasks_given_twice()) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("{}: plc_app_init called __sys__setup__tasks more than once", path));
  }
  auto tasks = build_tasks(*host.tasks());
  if (!tasks) return failure_in(path, std::move(tasks).error());
  if (auto applied = apply_task_settings(host.task_options(), *tasks); !applied) {
    return failure_in(path, std::move(applied).error());
  }
  return Application(*std::move(object), *host.tasks(), *std::move(tasks));
}

void Application::exit() {
  using Exit = void (*)();
  const auto exit = std::bit_cast<Exit>(object_.find("plc_app_exit"));
  if (exit == nullptr) return;
  try {
    exit();
  } catch (const std::exception& error) {
    spdlog::error("{}: plc_app_exit threw: {}", object_.path(), error.what());
  } catch (...) {
    spdlog::error("{}: plc_app_exit threw an exception", object_.path());
  }
}

std::string Application::name() const {
  return static_cast<const char*>(setup_->stApplicationName);
}

}  // namespace plchost
