#include <fmt/format.h>

#include "manager/supervisor/managed_instance.hpp"
#include "shm/base/log.hpp"

namespace plchost {

namespace {

// A path that came with the command, or was found for it.
bool loads(ControlVerb verb) {
  return verb == ControlVerb::load_application || verb == ControlVerb::download_application ||
         verb == ControlVerb::rollback_application;
}

}  // namespace

void ManagedInstance::begin_download() {
  const ControlRequest& request = operation_->request;
  const auto order = ApplicationOrder::from_options(request.options);
  if (!order) return finish(order.error().code, order.error().describe());
  operation_->step = Step::storing;
  const auto started =
      surroundings_.applications.keep(*order, request.argument, application_,
                                      [this](const Result<std::string>& path) { on_application_kept(path); });
  if (!started) finish(started.error().code, started.error().describe());
}

void ManagedInstance::on_application_kept(const Result<std::string>& path) {
  if (!operation_ || operation_->step != Step::storing) return;  // the manager is shutting down
  if (!path) return finish(path.error().code, path.error().describe());
  operation_->request.argument = *path;
  apply_loaded_application();
}

void ManagedInstance::begin_rollback() {
  const auto loaded = surroundings_.applications.version_at(application_);
  if (!loaded) {
    return finish(ErrorCode::wrong_state,
                  application_.empty()
                      ? fmt::format("'{}' has no application", config_.name)
                      : fmt::format("{} was not sent to '{}': what was loaded before it is not known",
                                    application_, config_.name));
  }
  if (loaded->before.empty()) {
    return finish(ErrorCode::not_found,
                  fmt::format("before version {} '{}' had no application", loaded->number, config_.name));
  }
  operation_->request.argument = loaded->before;
  begin_load();
}

bool ManagedInstance::sets_boot(ErrorCode code) const {
  if (code != ErrorCode::ok || operation_->step == Step::setting_boot) return false;
  const ControlRequest& request = operation_->request;
  const auto boot = request.options.find(std::string(kBootOption));
  return loads(request.verb) && boot != request.options.end() && boot->second == kYes;
}

// Last of all: what does not come up does not become the boot application.
void ManagedInstance::set_boot(const std::string& text) {
  operation_->step = Step::setting_boot;
  const auto tell = [this, text](const Result<std::string>& path) {
    if (!operation_ || operation_->step != Step::setting_boot) return;
    if (path) return finish(ErrorCode::ok, text);
    finish(path.error().code,
           fmt::format("it is loaded, but not the boot application: {}", path.error().describe()));
  };
  const auto started = surroundings_.applications.set_boot(operation_->request.argument, tell);
  if (!started) tell(std::unexpected(started.error()));
}

// What a client is told when it has worked: which version is in the instance now.
std::string ManagedInstance::loaded_text() const {
  if (!operation_ || operation_->request.verb == ControlVerb::load_application) return "";
  const std::string& path = operation_->request.argument;
  if (!loads(operation_->request.verb)) return "";
  const auto version = surroundings_.applications.version_at(path);
  return version ? fmt::format("version {} ({}) is loaded", version->number, version->name)
                 : fmt::format("{} is loaded", path);
}

}  // namespace plchost
