// The rights to the folders and files of a host: those of the Manager, of instances and of the API server.

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "api/control/application_versions.hpp"
#include "manager/manager.hpp"
#include "manager/server_files.hpp"
#include "manager/store/exception_folder.hpp"
#include "shm/files/memory_rights.hpp"
#include "shm/files/own_folder.hpp"
#include "shm/files/replace_file.hpp"
#include "shm/log/log.hpp"
#include "shm/pages/foreign_files.hpp"

namespace plchost {

namespace {

constexpr Duration kStateLimit = std::chrono::seconds(2);

std::vector<std::string> state_folders(const HostConfig& host) {
  return {host.state_directory, wishes_folder(host.state_directory, host.name),
          applications_folder(host.state_directory, host.name),
          exceptions_folder(host.state_directory, host.name), audit_folder(host)};
}

// That could start with it. Nothing: no other one than root.
std::optional<uid_t> other_owner(const std::string& folder) {
  struct stat status{};
  const bool is_known = ::stat(folder.c_str(), &status) == 0 && (status.st_mode & S_IWOTH) == 0;
  return is_known && status.st_uid != 0 ? std::optional(status.st_uid) : std::nullopt;
}

// A text: why nothing can be kept in it. Empty: it is a folder, or there is none yet.
std::string why_no_folder(const std::string& path) {
  struct stat status{};
  if (::stat(path.c_str(), &status) == 0)
    return S_ISDIR(status.st_mode) ? "" : fmt::format("{} is not a folder", path);
  const int error = errno;
  if (error != ENOENT) return fmt::format("{} cannot be used: {}", path, std::strerror(error));
  const bool is_link = ::lstat(path.c_str(), &status) == 0;
  return is_link ? fmt::format("{} is a link to something that is not there", path) : "";
}

}  // namespace

// Applications in them are run, and wishes followed.
Result<void> check_state_folders(const HostConfig& host) {
  for (const std::string& folder : state_folders(host)) {
    auto ours = check_own_folder(folder);
    if (ours || ours.error().code != ErrorCode::refused) continue;
    if (const auto owner = other_owner(folder)) {
      ours.error().message += fmt::format(
          ". This is about a start by user {}; if user {} is to start the manager, check as that one",
          ::geteuid(), *owner);
    }
    return ours;
  }
  return {};
}

Result<void> check_state_is_kept(const HostConfig& host) {
  for (const std::string& folder : state_folders(host)) {
    if (const std::string why = why_no_folder(folder); !why.empty()) {
      return failure(ErrorCode::invalid_argument,
                     fmt::format("{}: a start would run, and keep nothing there; mend that, or name another "
                                 "folder",
                                 why));
    }
  }
  return {};
}

// A disk that hangs is no reason to stop a plant here, either.
Result<void> Manager::check_state_folders() {
  const auto check = [host = config_.host]() -> Result<void> { return plchost::check_state_folders(host); };
  constexpr const char* kWhere = "[host] state_directory";
  const auto checked = state_disk_.ask<Result<void>>(kStateLimit, kWhere, check);
  if (!checked) {
    spdlog::error("the manager cannot see who may write there: {}", checked.error().describe());
  } else if (!*checked) {
    return failure_in(kWhere, checked->error());
  }
  return {};
}

// Also those of instances that run on from before another configuration.
Result<void> Manager::find_instance_user() {
  const HostConfig& host = config_.host;
  std::vector<uid_t> users = users_in(host.run_directory);
  if (!host.instance_user.empty()) {
    auto found = find_user(host.instance_user);
    if (!found) return failure_in("[host] instance_user", std::move(found).error());
    instance_user_ = *std::move(found);
    users.insert(users.begin(), instance_user_->number);
  }
  for (const uid_t user : users) {
    if (!trust_instances_of(user))
      spdlog::error("instances of user {} cannot be seen: {} other users are known", user,
                    kMostInstanceUsers);
  }
  return {};
}

// Instances that lack something say so themselves; a disk that hangs keeps none from its start. Those that
// run on with another user than the next ones still write there.
void Manager::share_folders() {
  const HostConfig& host = config_.host;
  std::vector<uid_t> users = users_in(host.run_directory, Claims::held);
  if (instance_user_) users.push_back(instance_user_->number);
  const auto shared = share_with_instances(host.run_directory, users);
  if (!shared) spdlog::error("[host] run_directory: instances may lack it: {}", shared.error().describe());
  const auto share = [folder = host.state_directory, users]() -> Result<void> {
    constexpr mode_t kModeWithoutMask = 0777;
    std::error_code error;
    if (!users.empty()) PLCHOST_TRY(make_synced_folders(folder, kModeWithoutMask));
    if (users.empty() && !std::filesystem::exists(folder, error)) return {};
    return share_with_instances(folder, users);
  };
  const auto answered = state_disk_.ask<Result<void>>(kStateLimit, "[host] state_directory", share);
  const auto state_shared = and_then(answered, [](const Result<void>& done) { return done; });
  if (!state_shared)
    spdlog::error("instances may lack [host] state_directory: {}", state_shared.error().describe());
}

// Beside the manager only instances write it.
Result<TransitionRing> Manager::open_transitions(const std::string& instance) const {
  auto ring = TransitionRing::open(config_.host.pool, instance);
  if (!ring) return ring;
  std::vector<uid_t> users;
  if (instance_user_) users.push_back(instance_user_->number);
  const auto shared = TransitionRing::let_write(config_.host.pool, instance, users);
  if (!shared) spdlog::error("instance {}: {}", instance, shared.error().describe());
  return ring;
}

void Manager::prepare_files(const std::string& instance) {
  const HostConfig& host = config_.host;
  // A damaged one is the manager's to replace.
  if (auto ring = open_transitions(instance)) transitions_.insert_or_assign(instance, *std::move(ring));
  hand_over_files({.instance = instance, .pool = host.pool, .run_directory = host.run_directory},
                  instance_user_);
  if (!instance_user_) return;
  const auto hand_over = [folder = host.state_directory, instance, user = instance_user_] {
    hand_over_retain_files(folder, instance, user);
    return true;
  };
  const auto done = state_disk_.ask<bool>(kStateLimit, "[host] state_directory", hand_over);
  if (!done)
    spdlog::error("instance {}: it may lack its retain files: {}", instance, done.error().describe());
}

bool Manager::server_has_own_user() const noexcept {
  return config_.dds.enabled && !config_.dds.user.empty();
}

// A server that lacks something says so itself; a disk that hangs keeps no instance from its start.
void Manager::share_with_server() {
  if (!server_has_own_user() && !instance_user_) return;
  give_roots_files(config_.host.pool, ::getegid());
  std::optional<gid_t> group;
  if (server_has_own_user()) {
    const auto server = find_user(config_.dds.user);
    if (!server) return spdlog::error("[dds] user: {}", server.error().describe());
    group = server->group;
  }
  const std::string audit = audit_folder(config_.host);
  const std::string applications = applications_folder(config_.host.state_directory, config_.host.name);
  // The audit log is not for the manager's group: instances have it, too.
  const auto share = [audit, applications, group]() -> Result<void> {
    PLCHOST_TRY(share_folder(applications, GroupRight::reads));
    if (!group) return keep_folder(audit);
    PLCHOST_TRY(share_folder(audit, GroupRight::writes, group));
    for (const std::string& folder : {audit + "/refused", audit + "/under_way"})
      PLCHOST_TRY(share_folder(folder, GroupRight::writes));
    return {};
  };
  const auto answered = state_disk_.ask<Result<void>>(kStateLimit, "[host] state_directory", share);
  const auto shared = and_then(answered, [](const Result<void>& done) { return done; });
  if (!shared) spdlog::error("the API server may lack files: {}", shared.error().describe());
}

}  // namespace plchost
