#include <optional>
#include <utility>

#include <fmt/format.h>

#include "manager/supervisor/managed_instance.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"
#include "shm/operations/operations.hpp"

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
  LaunchOptions launch = launch_options(Next::run);
  launch.kept_settings = false;
  const auto started =
      own_.applications.keep(*order, request.argument, {.now = application_, .earlier = before_.value_or("")},
                             launch, [this](const Result<std::string>& path) { on_application_kept(path); });
  if (!started) finish(started.error().code, started.error().describe());
}

void ManagedInstance::on_application_kept(const Result<std::string>& path) {
  if (!operation_ || operation_->step != Step::storing) return;  // the manager is shutting down
  if (!path) return finish(path.error().code, path.error().describe());
  operation_->request.argument = *path;
  apply_loaded_application();
}

void ManagedInstance::begin_rollback() {
  const auto loaded = own_.applications.version_at(application_);
  if (!loaded) {
    return finish(ErrorCode::wrong_state,
                  application_.empty() ? fmt::format("'{}' has no application", config_.name)
                                       : fmt::format("{} was not sent to '{}': its predecessor is not known",
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
  return has_option(kBootOption);
}

bool ManagedInstance::has_option(std::string_view name) const {
  const ControlRequest& request = operation_->request;
  const auto option = request.options.find(std::string(name));
  return loads(request.verb) && option != request.options.end() && option->second == kYes;
}

bool ManagedInstance::loads_online() const {
  return has_option(kOnlineOption);
}

bool ManagedInstance::takes_over() const {
  return operation_ && operation_->step == Step::forwarded && loads_online();
}

// Whether there is a process that another version could take over in.
Result<void> ManagedInstance::check_online() const {
  const bool runs = status_.state == InstanceState::running || status_.state == InstanceState::stopped;
  if (phase_ == Phase::up && !silent_ && runs && !application_.empty()) return {};
  return failure(ErrorCode::wrong_state,
                 fmt::format("'{}' is {}: an application takes over online from one that runs or is stopped; "
                             "load it without --online",
                             config_.name,
                             phase_ == Phase::up && application_.empty() ? "without application"
                                                                         : to_string(status_.state)));
}

void ManagedInstance::begin_change() {
  if (auto good = check_online(); !good) return finish(good.error().code, good.error().message);
  operation_->step = Step::forwarded;
  const auto number = send_limited(ControlVerb::change_application, operation_->request);
  if (!number) return finish(number.error().code, number.error().describe());
  operation_->forwarded_number = *number;
  host_.set_timer(after(operation_of(ControlVerb::change_application).limit));
}

// The loaded application has not come up: the one before is started instead.
void ManagedInstance::take_back_application(const std::string& why) {
  taken_back_ = cut(fmt::format("{} does not come up: {}", application_, why), kMaxWishText);
  application_ = *std::exchange(before_, std::nullopt);
  start_kind_ = StartKind::warm;
  // A configuration that has changed meanwhile lets taken_back_ go in spawn(), and the client's command
  // failed all the same.
  if (operation_ && operation_->step == Step::fresh_process) operation_->refused = taken_back_;
  spdlog::warn("instance {}: {}; {} is started again with the settings that it ran with", config_.name,
               taken_back_, application_);
  spawn(wants_running_ ? Next::run : Next::stay_stopped);
}

// Last of all: an application that does not come up does not become the boot application.
void ManagedInstance::set_boot(const std::string& text) {
  operation_->step = Step::setting_boot;
  const auto tell = [this, text](const Result<std::string>& path) {
    if (!operation_ || operation_->step != Step::setting_boot) return;
    if (path) return finish(ErrorCode::ok, text);
    finish(path.error().code,
           fmt::format("it is loaded, but not the boot application: {}", path.error().describe()));
  };
  const auto started = own_.applications.set_boot(operation_->request.argument, config_.application, tell);
  if (!started) tell(std::unexpected(started.error()));
}

// An application that was loaded long ago must not win without a word.
void ManagedInstance::tell_boot_application() const {
  if (application_ == begun_with_.application)
    return;  // nobody has loaded it: the configuration has changed since
  const auto version = own_.applications.version_at(application_);
  const std::string what =
      version ? fmt::format("version {} ({}, {})", version->number, version->name,
                            version->by.empty() ? "sent by an unsecured client" : "sent by " + version->by)
              : application_;
  const bool boot = application_ == own_.applications.boot();
  spdlog::info("instance {}: {} {}, in the place of {} of the configuration{}", config_.name,
               boot ? "its boot application is" : "the application that was loaded last is", what,
               config_.application.empty() ? "none" : config_.application,
               config_.application.empty()
                   ? ""
                   : fmt::format("; 'plcctl load application {} {} --on-host --boot' takes that back",
                                 config_.name, config_.application));
}

// The answer to a client on success: the version that is in the instance now.
std::string ManagedInstance::loaded_text() const {
  if (!operation_ || operation_->request.verb == ControlVerb::load_application) return "";
  const std::string& path = operation_->request.argument;
  if (!loads(operation_->request.verb)) return "";
  const auto version = own_.applications.version_at(path);
  return version ? fmt::format("version {} ({}) is loaded", version->number, version->name)
                 : fmt::format("{} is loaded", path);
}

}  // namespace plchost
